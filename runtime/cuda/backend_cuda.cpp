// SPDX-License-Identifier: Apache-2.0
#include "runtime/cuda/backend_cuda.h"

#include "kernels/blend/blend_cuda.h"
#include "kernels/math/lod.h"
#include "kernels/sort/sort_cuda.h"
#include "runtime/cuda/ceilings_cuda.h"
#include "runtime/cuda/frame_graph.h"
#include "runtime/frame_checks.h"
#include "runtime/view/lod_lag.h"
#include "runtime/reuse/reuse_cuda.h"

#include <algorithm>
#include <deque>
#include <optional>

namespace gsc {

namespace {

constexpr size_t kGraphs = 8; // kept for frames to come

class CudaBackend final : public Backend {
public:
    CudaBackend() : m_limits(openCudaDevice()), m_scene(m_budget), m_reuse(m_budget), m_arena(m_budget)
    {
        prepareDecodeCuda();
        prepareDecodeKeepCuda();
        prepareDecodeExactCuda(m_limits.shared_bytes);
        prepareSortCuda();
        prepareBlendCuda();
        m_budget.used = cudaContextBytes();
    }

    [[nodiscard]] const char* name() const override { return "cuda"; }
    [[nodiscard]] DeviceFacts device() const override { return cudaFacts(); }
    [[nodiscard]] DeviceCeilings ceilings() override
    {
        return measureCudaCeilings(m_budget.limit == 0 ? UINT64_MAX
                                                       : m_budget.limit - std::min(m_budget.limit, m_budget.used));
    }
    [[nodiscard]] Tier tierOf(Tier asked) const override
    {
        return asked == Tier::Exact || !m_scene.fastPossible() ? Tier::Exact : Tier::Fast;
    }

    void setMemoryBudget(uint64_t bytes) override { m_budget.limit = bytes; }

    void load(const ModelView& model) override
    {
        openCudaDevice(); // the caller's thread may be a new one
        checkModel(model);
        m_graphs.clear();
        m_arena.release(); // a model that is larger than the last may need it
        m_reuse.release();
        m_scene.load(model, m_stream);
        m_capacity = {};
        forgetLoad();
        m_lag.clear();
    }

    void dropCaches() override
    {
        m_lag.clear();
        m_graphs.clear();
        m_reuse.drop();
        forgetLoad(); // what follows is drawn as after load()
    }

    void render(const EyeParams* eyes, uint32_t eye_count, const FrameOptions& options, float* const* images,
                FrameResult& result) override;

private:
    // Refuses what cannot be drawn. `eyes` of `now` may change by a rounding (shareBins()).
    FrameShape shapeOf(FrameNow& now, uint32_t eye_count, const FrameOptions& options) const;
    [[nodiscard]] uint64_t frameBytes(FrameShape shape, const FrameCapacity& capacity) const;
    [[nodiscard]] uint32_t gapsOf(const FrameShape& shape, uint32_t slots) const
    {
        const uint32_t processors = m_limits.processors;
        return shape.exact
                   ? decodeExactGaps(m_scene.exactWeights() != nullptr, processors, m_limits.shared_bytes, slots)
               : shape.uses_reuse ? decodeKeepGaps(processors, slots) + drawKeptGaps(processors, slots)
                                  : decodeFastGaps(processors, slots);
    }
    [[nodiscard]] uint64_t freeForFrames() const;
    [[nodiscard]] FrameRoom roomFor(const FrameShape& shape) const;
    [[nodiscard]] uint32_t slabBitsNow() const;
    void planCapacity(const FrameShape& shape);
    void forgetLoad() // of earlier frames
    {
        m_free = freeForFrames();
        m_splats = m_pairs = m_peak = 0;
        m_planned.reset();
    }
    void choosePasses(FrameShape& shape);
    void giveFramesBack() // their memory
    {
        m_graphs.clear();
        m_arena.release();
    }
    const FrameNow& beginReuse(const FrameShape& shape, const FrameNow& now, const FrameOptions& options);
    FrameGraph& graphFor(const FrameShape& shape, const FrameNow& now);
    bool growAfterOverflow(FrameShape& shape);
    void report(const FrameShape& shape, FrameResult& result);

    MemoryBudget m_budget; // before everything that gives memory back to it
    CudaLimits m_limits;
    CudaStream m_stream;
    PinnedCounters m_counters;
    DeviceScene m_scene;
    CudaReuse m_reuse;
    DeviceArena m_arena;
    LodLag m_lag;
    FrameBuffers m_buffers{};
    FrameCapacity m_capacity;
    struct Plan { // what the capacity was last planned for
        bool exact, uses_reuse;
        uint32_t eye_count, lists, bins;
        uint64_t bytes;

        bool operator==(const Plan&) const = default;
    };
    std::optional<Plan> m_planned;
    uint64_t m_free = 0;                              // bytes of the device that frames may take
    uint64_t m_splats = 0, m_pairs = 0;               // of the last frame, all passes: of the longer list, of all
    uint64_t m_peak = 0;                              // most splats of a pass and a list so far
    std::deque<std::unique_ptr<FrameGraph>> m_graphs; // the last used first
};

FrameShape CudaBackend::shapeOf(FrameNow& now, uint32_t eye_count, const FrameOptions& options) const
{
    if (m_scene.host().params == nullptr)
        throw Error(
            ErrorCode::Internal,
            "cuda: no model is loaded, expected load() before render(); this is a bug of gsc, please report it");
    checkOptions(m_scene.host(), options, eye_count);
    checkReuse(options.reuse);
    refuseMergedReuse(options, eye_count);
    if (options.reuse.policy != ReusePolicy::None && tierOf(options.tier) == Tier::Exact)
        throw Error(ErrorCode::Unsupported, "cuda: reuse in the tier exact, expected reuse policy none there; use the "
                                            "tier fast, if the model has it, or the backend cpu");
    FrameShape shape{};
    uint32_t width = 0, height = 0;
    for (uint32_t e = 0; e < eye_count; ++e) {
        const EyeParams& eye = now.eyes[e];
        checkSize(eye.width, eye.height);
        width = std::max(width, eye.width);
        height = std::max(height, eye.height);
        shape.width[e] = eye.width;
        shape.height[e] = eye.height;
    }
    // low bins cut long lists shorter; an image too high for them takes bins of twice the height
    shape.grid.height = height <= kMaxBins * 16 ? 16 : 32;
    if (width > kMaxBins * kBinWidth || height > kMaxBins * shape.grid.height)
        throw Error(ErrorCode::Unsupported,
                    formatString("cuda: image of %u x %u pixels, expected at most %u x %u; choose a smaller size or "
                                 "--backend cpu",
                                 width, height, kMaxBins * kBinWidth, kMaxBins * 32));
    shape.grid.columns = (width + kBinWidth - 1) / kBinWidth;
    shape.grid.rows = (height + shape.grid.height - 1) / shape.grid.height;
    shape.eye_count = eye_count;
    shape.passes = 1;
    shape.rules = rasterConstants(*m_scene.host().params, options.near_z);
    shape.exact = tierOf(options.tier) == Tier::Exact;
    shape.fades = levelsFade(*m_scene.host().params, options.lod_fade);
    shape.merged = decodesMerged(options, eye_count);
    shape.uses_reuse = options.reuse.policy != ReusePolicy::None;
    shape.limits_decoding = CudaReuse::limitsDecoding(options.reuse);
    std::copy_n(options.background, 3, shape.background);
    shape.appearance = options.appearance;
    shape.empty_is_black = options.empty_is_black;
    shape.shareBins(now.eyes);
    return shape;
}

// Bytes of a frame's buffers, however their bins are cut.
uint64_t CudaBackend::frameBytes(FrameShape shape, const FrameCapacity& capacity) const
{
    shape.grid.slab_bits = slabBits(capacity.slots);
    ArenaLayout counted(nullptr);
    layOutFrame(counted, m_scene, shape, capacity, m_limits);
    return counted.bytes();
}

// Cells for the load of earlier frames; before the first for a quarter of what there is room for.
uint32_t CudaBackend::slabBitsNow() const
{
    const uint64_t load = m_peak > 0 ? m_peak + m_peak / 2 : m_capacity.slots / 4;
    return slabBits(uint32_t(std::min<uint64_t>(load, m_capacity.slots)));
}

// What the model and what is kept left of the device's memory, but for some that others may want.
uint64_t CudaBackend::freeForFrames() const
{
    size_t left = 0, total = 0;
    GSC_CUDA_CHECK(cudaMemGetInfo(&left, &total));
    left += m_arena.bytes();
    return left - left / 16;
}

FrameRoom CudaBackend::roomFor(const FrameShape& shape) const
{
    const uint64_t others = m_budget.used - m_arena.bytes();
    const DeviceModel& model = m_scene.model();
    FrameRoom room{};
    room.anchors = model.anchor_count;
    room.gaussians = uint64_t(model.anchor_count) * model.params.n_offsets;
    room.lists = shape.lists();
    room.bins = shape.bins();
    const uint64_t allowed = std::max(m_budget.limit, others) - others;
    room.budgeted = m_budget.limit != 0 && allowed <= m_free;
    room.bytes = room.budgeted ? allowed : m_free;
    room.levels = (model.params.flags & kModelHasLevels) && model.params.level_rule != uint32_t(LevelRule::None);
    room.gaps = [this, &shape](uint32_t slots) { return gapsOf(shape, slots); };
    room.bytes_of = [this, &shape](const FrameCapacity& capacity, uint32_t passes) {
        FrameShape cut = shape;
        cut.passes = passes;
        return frameBytes(cut, capacity);
    };
    return room;
}

// Once for every kind of frame and what memory is left for it.
void CudaBackend::planCapacity(const FrameShape& shape)
{
    const FrameRoom room = roomFor(shape);
    const Plan plan{shape.exact, shape.uses_reuse, shape.eye_count, shape.lists(), shape.bins(), room.bytes};
    if (m_planned == plan)
        return;
    m_planned = plan;
    m_capacity = plannedCapacity(room, m_capacity);
}

// As many passes as the last frame's load needs. The image depends on it by rounding alone.
void CudaBackend::choosePasses(FrameShape& shape)
{
    shape.passes = passesFor(roomFor(shape), m_splats, m_pairs, m_capacity);
}

// Memory of entries comes before that of frames, which take what it leaves. Returns what the frame's graph is launched
// with.
const FrameNow& CudaBackend::beginReuse(const FrameShape& shape, const FrameNow& now, const FrameOptions& options)
{
    if (!shape.uses_reuse) {
        m_reuse.skipFrame();
        return now;
    }
    if (m_reuse.needsMemory(options.reuse, shape.eye_count)) {
        giveFramesBack();
        m_reuse.prepare(m_scene, options.reuse, shape.eye_count, m_stream);
        m_free = freeForFrames();
    }
    return m_reuse.begin(now, shape.eye_count, options, m_stream);
}

FrameGraph& CudaBackend::graphFor(const FrameShape& shape, const FrameNow& now)
{
    if (m_arena.reserve(frameBytes(shape, m_capacity), "a frame"))
        m_graphs.clear();
    // note: an arena that is large enough is laid out anew for every shape, which moves the buffers of the other graphs
    // too; each graph has its own addresses, and nothing outlives a frame but the image, read before the next one
    ArenaLayout layout(m_arena.get());
    m_buffers = layOutFrame(layout, m_scene, shape, m_capacity, m_limits);
    const FrameJob job{m_scene, shape, now, m_capacity, m_buffers, m_limits};
    const auto found =
        std::find_if(m_graphs.begin(), m_graphs.end(), [&](const auto& graph) { return graph->fits(job); });
    if (found != m_graphs.end()) {
        std::rotate(m_graphs.begin(), found, found + 1);
    } else {
        m_graphs.push_front(std::make_unique<FrameGraph>(job, m_reuse, m_counters.data, m_stream));
        if (m_graphs.size() > kGraphs)
            m_graphs.pop_back();
    }
    return *m_graphs.front();
}

// True if a buffer was too small; it is larger then, or there are more passes, and the frame is to be drawn again.
bool CudaBackend::growAfterOverflow(FrameShape& shape)
{
    const FrameCounters& c = *m_counters.data;
    if (c.overflow == 0)
        return false;
    shape.passes =
        grownPasses(roomFor(shape), {c.anchors_listed, c.most_slots, c.most_pairs}, shape.passes, m_capacity);
    return true;
}

void CudaBackend::report(const FrameShape& shape, FrameResult& result)
{
    const FrameCounters& c = *m_counters.data;
    for (uint32_t e = 0; e < shape.eye_count; ++e) {
        EyeCounts& eye = result.eyes[e];
        eye.groups_tested = m_scene.model().params.group_count;
        eye.anchors_tested = c.anchors_tested[e];
        eye.anchors_visible = c.anchors_visible[e];
        eye.anchors_decoded = !shape.merged ? c.anchors_visible[e] : e == 0 ? c.anchors_listed : 0;
        eye.gaussians_alive = c.gaussians[e];
        eye.gaussians_visible = c.splats[e];
        eye.gaussians_dropped = c.dropped[e];
        eye.pairs = c.pairs[e];
        eye.blend_evaluations = c.evaluations[e];
    }
    if (shape.uses_reuse)
        m_reuse.addCounts(shape.eye_count, result);
    result.cache_bytes = m_reuse.bytes();
    result.bytes_resident = m_budget.used;
    result.passes = shape.passes;
}

void CudaBackend::render(const EyeParams* eyes, uint32_t eye_count, const FrameOptions& options, float* const* images,
                         FrameResult& result)
{
    FrameNow plain{};
    std::copy_n(eyes, std::min(eye_count, kMaxEyes), plain.eyes);
    FrameShape shape = shapeOf(plain, eye_count, options);
    if (shape.exact && !m_scene.exactLoaded()) {
        giveFramesBack(); // what frames in `fast` took may be what the model in fp32 needs
        m_scene.loadExact(m_stream);
        m_free = freeForFrames();
    }
    if (m_scene.fastPossible())
        m_scene.useAppearance(options.appearance, m_stream);
    m_lag.follow(m_scene.host(), options, eyes, eye_count, plain.level_eyes);
    if (shape.merged)
        mergedCenter(plain.eyes, plain.look_from);
    plain.lod_bias = options.lod_bias;
    plain.lod_fade = options.lod_fade;
    const FrameNow& now = beginReuse(shape, plain, options);
    planCapacity(shape);
    choosePasses(shape);
    StageTimes last;
    result = {};
    do {
        shape.uses_reuse = shape.uses_reuse && shape.passes == 1; // of a pass's entries only some would be decoded
        shape.grid.slab_bits = slabBitsNow();
        FrameGraph& graph = graphFor(shape, now);
        graph.launch(now, m_stream);
        GSC_CUDA_CHECK(cudaStreamSynchronize(m_stream.handle));
        last = graph.times();
        result.times.add(last);
        ++result.repeats;
        if (shape.uses_reuse)
            m_reuse.endTry();
    } while (growAfterOverflow(shape));
    --result.repeats;
    result.repeat_ms = result.times.total - last.total;
    const FrameCounters& c = *m_counters.data;
    m_splats = c.all_slots;
    m_pairs = c.pairs[0] + c.pairs[1];
    m_peak = std::max<uint64_t>(m_peak, c.most_slots);
    for (uint32_t e = 0; e < eye_count; ++e)
        if (images != nullptr && images[e] != nullptr)
            GSC_CUDA_CHECK(cudaMemcpyAsync(images[e], m_buffers.image[e], shape.pixels(e) * 3 * sizeof(float),
                                           cudaMemcpyDeviceToHost, m_stream.handle));
    report(shape, result);
    GSC_CUDA_CHECK(cudaStreamSynchronize(m_stream.handle));
}

} // namespace

std::unique_ptr<Backend> makeCudaBackend()
{
    return std::make_unique<CudaBackend>();
}

} // namespace gsc
