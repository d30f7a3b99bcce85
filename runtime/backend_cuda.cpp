// SPDX-License-Identifier: Apache-2.0
#include "runtime/backend_cuda.h"

#include "kernels/blend/blend_cuda.h"
#include "kernels/math/lod.h"
#include "kernels/sort/sort_cuda.h"
#include "runtime/backend_cpu.h"
#include "runtime/ceilings_cuda.h"
#include "runtime/cut_cuda.h"
#include "runtime/frame_graph.h"
#include "runtime/lod_lag.h"
#include "runtime/order_cuda.h"

#include <algorithm>
#include <bit>
#include <deque>
#include <optional>

namespace gsc {

namespace {

// Splats of one eye and pass that a frame's memory is kept to where there is enough: in `fast` 3.3 GB for two eyes that
// share their bins and 3.7 for others, and up to 1.5 GB of pairs. More are drawn in several passes.
constexpr uint32_t kSlotTarget = 44u << 20;
constexpr uint32_t kLeastSlots = 1u << 12; // beside twice the gaps: with fewer there would be too many passes
constexpr uint32_t kPairsPerSlot = 4;      // at most, of all eyes, where memory is short
constexpr size_t kGraphs = 8;              // kept for frames to come

// Cells of some hundred splats; the order of a bin's list does not depend on how it was cut.
uint32_t slabBits(uint32_t slots)
{
    return uint32_t(std::bit_width(std::clamp<uint32_t>(slots / 16384, 4, kMaxSlabs))) - 1;
}

class CudaBackend final : public Backend {
public:
    CudaBackend()
        : m_limits(openCudaDevice()), m_scene(m_budget), m_reuse(m_budget), m_cut(m_budget), m_order(m_budget),
          m_arena(m_budget)
    {
        prepareDecodeCuda();
        prepareDecodeKeepCuda();
        prepareDecodeExactCuda(m_limits.shared_bytes);
        prepareSortCuda();
        prepareBlendCuda();
    }

    [[nodiscard]] const char* name() const override { return "cuda"; }
    [[nodiscard]] DeviceFacts device() const override { return cudaFacts(); }
    [[nodiscard]] DeviceCeilings ceilings() override
    {
        return measureCudaCeilings(m_budget.limit == 0 ? UINT64_MAX : m_budget.limit - m_budget.used);
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
        m_cut.drop();
        m_order.drop();
        m_scene.load(model, m_stream);
        m_free = freeForFrames();
        m_splats = m_pairs = 0;
        m_lod_bias.reset();
        m_lag.clear();
    }

    void dropCaches() override
    {
        m_lag.clear();
        m_graphs.clear();
        m_reuse.drop();
        m_cut.drop();
        m_order.drop();
        m_free = freeForFrames();
        m_lod_bias.reset();
        m_splats = m_pairs = 0; // what follows is drawn as after load()
    }

    void render(const EyeParams* eyes, uint32_t eye_count, const FrameOptions& options, float* const* images,
                FrameResult& result) override;

private:
    FrameShape shapeOf(const EyeParams* eyes, uint32_t eye_count, const FrameOptions& options) const;
    [[nodiscard]] uint64_t frameBytes(FrameShape shape, const FrameCapacity& capacity) const;
    [[nodiscard]] uint32_t gapsOf(const FrameShape& shape, uint32_t slots) const
    {
        const uint32_t processors = m_limits.processors;
        return shape.exact
                   ? decodeExactGaps(m_scene.exactWeights() != nullptr, processors, m_limits.shared_bytes, slots)
               : shape.keeps ? decodeKeepGaps(processors, slots) + drawKeptGaps(processors, slots)
                             : decodeFastGaps(processors, slots);
    }
    [[nodiscard]] uint64_t freeForFrames() const;
    [[nodiscard]] uint32_t slotLimit(FrameShape shape);
    void choosePasses(FrameShape& shape);
    void giveFramesBack() // their memory
    {
        m_graphs.clear();
        m_arena.release();
    }
    void beginReuse(const FrameShape& shape, const FrameOptions& options);
    void beginCut(const FrameShape& shape, const EyeParams* chosen, const FrameOptions& options);
    void beginOrder(const FrameOptions& options);
    FrameGraph& graphFor(const FrameShape& shape, const FrameOptions& options);
    bool growAfterOverflow(FrameShape& shape);
    // first: counters of the first time it was drawn, when the cut cache did not yet know what it shows
    void report(const FrameShape& shape, const FrameGraph& graph, const FrameOptions& options,
                const FrameCounters& first, FrameResult& result);

    MemoryBudget m_budget; // before everything that gives memory back to it
    CudaLimits m_limits;
    CudaStream m_stream;
    PinnedCounters m_counters;
    DeviceScene m_scene;
    CudaReuse m_reuse;
    CudaCut m_cut;
    CudaOrder m_order;
    DeviceArena m_arena;
    LodLag m_lag;
    FrameBuffers m_buffers{};
    FrameCapacity m_capacity;
    std::optional<float> m_lod_bias;                  // of the last frame
    uint64_t m_free = 0;                              // bytes of the device that frames may take
    uint64_t m_splats = 0, m_pairs = 0;               // of the last frame, all passes: of the longer list, of all
    std::deque<std::unique_ptr<FrameGraph>> m_graphs; // the last used first
};

FrameShape CudaBackend::shapeOf(const EyeParams* eyes, uint32_t eye_count, const FrameOptions& options) const
{
    if (m_scene.host().params == nullptr)
        throw Error(ErrorCode::Internal, "cuda: no model is loaded, expected load() before render()");
    checkOptions(m_scene.host(), options, eye_count);
    checkReuse(options.reuse);
    refuseMergedReuse(options, eye_count);
    if (options.reuse.policy != ReusePolicy::None && tierOf(options.tier) == Tier::Exact)
        throw Error(ErrorCode::Unsupported, "cuda: reuse in the tier exact, expected reuse policy none there; use the "
                                            "tier fast, if the model has it, or the backend cpu");
    FrameShape shape{};
    uint32_t width = 0, height = 0;
    for (uint32_t e = 0; e < eye_count; ++e) {
        checkSize(eyes[e].width, eyes[e].height);
        width = std::max(width, eyes[e].width);
        height = std::max(height, eyes[e].height);
        shape.eyes[e] = eyes[e];
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
    shape.keeps = options.reuse.policy != ReusePolicy::None;
    shape.budgeted = CudaReuse::budgeted(options.reuse);
    // the slacks of the cut are those of a hard switch at the eye itself
    // and of one bias: with one that changes all the time they would be found in vain
    shape.cuts = options.reuse.cut && !shape.fades && options.lod_hysteresis == 0 &&
                 m_lod_bias.value_or(options.lod_bias) == options.lod_bias;
    shape.shareBins();
    return shape;
}

// Bytes of a frame's buffers.
uint64_t CudaBackend::frameBytes(FrameShape shape, const FrameCapacity& capacity) const
{
    shape.grid.slab_bits = slabBits(capacity.slots);
    ArenaLayout counted(nullptr);
    layOutFrame(counted, m_scene, shape, capacity, m_limits);
    return counted.bytes();
}

// What the model and what is kept left of the device's memory, but for some that others may want.
uint64_t CudaBackend::freeForFrames() const
{
    size_t left = 0, total = 0;
    GSC_CUDA_CHECK(cudaMemGetInfo(&left, &total));
    left += m_arena.bytes();
    return left - left / 16;
}

// Splats of one eye and pass that memory allows. Makes the capacity smaller if there is no memory for it as it is.
uint32_t CudaBackend::slotLimit(FrameShape shape)
{
    shape.passes = std::max(shape.passes, 2u); // with the memory between passes
    const uint64_t others = m_budget.used - m_arena.bytes(), limit_bytes = std::max(m_budget.limit, others);
    const uint64_t room = m_budget.limit == 0 ? m_free : limit_bytes - others;
    if (frameBytes(shape, {m_capacity.visible, kSlotTarget, kSlotTarget * kPairsPerSlot}) <= room)
        return kSlotTarget;
    uint32_t limit = kLeastSlots + 2 * gapsOf(shape, kLeastSlots), too_many = kSlotTarget + 1;
    while (too_many - limit > limit / 64) {
        const uint32_t slots = limit + (too_many - limit) / 2;
        if (frameBytes(shape, {m_capacity.visible, slots, slots * kPairsPerSlot}) <= room)
            limit = slots;
        else
            too_many = slots;
    }
    if (frameBytes(shape, m_capacity) > room) {
        m_capacity.slots = std::min(m_capacity.slots, limit);
        m_capacity.pairs = std::min(m_capacity.pairs, limit * kPairsPerSlot);
    }
    return limit;
}

// As many passes as the last frame's load needs. The image depends on it by rounding alone.
void CudaBackend::choosePasses(FrameShape& shape)
{
    const uint32_t limit = slotLimit(shape);
    const auto passes = [](uint64_t load, uint64_t room) { return (load + load / 8 + room - 1) / room; };
    const uint64_t most =
        std::max(passes(m_splats, limit - gapsOf(shape, limit)), passes(m_pairs, uint64_t(limit) * kPairsPerSlot));
    shape.passes = uint32_t(std::clamp<uint64_t>(most, 1, kMaxPasses));
}

// Memory of entries comes before that of frames, which take what it leaves.
void CudaBackend::beginReuse(const FrameShape& shape, const FrameOptions& options)
{
    if (!shape.keeps) {
        m_reuse.skipFrame();
        return;
    }
    if (m_reuse.needsMemory(options.reuse, shape.eye_count)) {
        giveFramesBack();
        m_reuse.prepare(m_scene, options.reuse, shape.eye_count, m_stream);
        m_free = freeForFrames();
    }
    m_reuse.begin(shape.eyes, shape.eye_count, options, m_stream);
}

void CudaBackend::beginCut(const FrameShape& shape, const EyeParams* chosen, const FrameOptions& options)
{
    if (!shape.cuts) {
        m_cut.forget();
        return;
    }
    const ModelParams& params = m_scene.model().params;
    if (m_cut.needsMemory(shape.eye_count)) {
        giveFramesBack();
        m_cut.prepare(uint32_t(params.group_count), shape.eye_count);
        m_free = freeForFrames();
    }
    m_cut.begin(params, chosen, shape.eye_count, shape.rules, options.lod_bias, m_stream);
}

// After the memory of entries, before that of frames, as above.
void CudaBackend::beginOrder(const FrameOptions& options)
{
    if (!options.reuse.order)
        return;
    if (m_order.needsMemory()) {
        giveFramesBack();
        m_order.prepare();
        m_free = freeForFrames();
    }
}

FrameGraph& CudaBackend::graphFor(const FrameShape& shape, const FrameOptions& options)
{
    ArenaLayout needed(nullptr);
    layOutFrame(needed, m_scene, shape, m_capacity, m_limits);
    if (m_arena.reserve(needed.bytes(), "a frame"))
        m_graphs.clear();
    // note: an arena that is large enough is laid out anew for every shape, which moves the buffers of the other graphs
    // too; each graph has its own addresses, and nothing outlives a frame but the image, read before the next one
    ArenaLayout layout(m_arena.get());
    m_buffers = layOutFrame(layout, m_scene, shape, m_capacity, m_limits);
    const FrameJob job{m_scene,  shape,          options,       m_capacity,   m_buffers,
                       m_limits, &m_reuse.job(), &m_cut.args(), m_order.job()};
    const auto found =
        std::find_if(m_graphs.begin(), m_graphs.end(), [&](const auto& graph) { return graph->fits(job); });
    if (found != m_graphs.end()) {
        std::rotate(m_graphs.begin(), found, found + 1);
    } else {
        m_graphs.push_front(std::make_unique<FrameGraph>(job, m_counters.data, m_stream));
        if (m_graphs.size() > kGraphs)
            m_graphs.pop_back();
    }
    return *m_graphs.front();
}

// True if a buffer was too small; it is larger then, or there are more passes, and the frame is to be drawn again. A
// stage after the one that overflowed has seen part of its input only, so this may take several rounds.
bool CudaBackend::growAfterOverflow(FrameShape& shape)
{
    const FrameCounters& c = *m_counters.data;
    if (c.overflow == 0)
        return false;
    const auto withSlack = [](uint64_t needed) { // the next frame, and the next try, may need some more
        return needed + needed / 8 + 1024;
    };
    uint64_t passes = shape.passes;
    // `fixed`: part of what is needed that more passes do not make less
    const auto grow = [&](uint32_t& capacity, uint64_t needed, uint64_t most, uint64_t fixed) {
        if (needed <= capacity)
            return;
        capacity = uint32_t(std::min(needed + needed / 2 + 1024, most)); // so that a walk grows it few times
        if (withSlack(needed) > most)
            passes = std::max(passes, shape.passes * withSlack(needed - std::min(needed, fixed)) / (most - fixed) + 1);
    };
    grow(m_capacity.visible, c.anchors_listed, m_scene.model().anchor_count, 0);
    const uint64_t limit = slotLimit(shape); // what the visible list has left
    grow(m_capacity.slots, c.most_slots, limit, gapsOf(shape, uint32_t(limit)));
    grow(m_capacity.pairs, c.most_pairs, limit * kPairsPerSlot, 0);
    if (passes > kMaxPasses) {
        if (shape.passes == kMaxPasses) { // all Gaussians at one depth, or a budget far too small
            if (withSlack(c.most_pairs) > UINT32_MAX)
                throw Error(ErrorCode::OutOfMemory,
                            formatString("cuda: %llu pairs of splat and bin in one pass, expected fewer than 2^32; "
                                         "choose a smaller --size or --backend cpu",
                                         c.most_pairs));
            m_capacity.slots = uint32_t(std::max<uint64_t>(m_capacity.slots, withSlack(c.most_slots)));
            m_capacity.pairs = uint32_t(std::max<uint64_t>(m_capacity.pairs, withSlack(c.most_pairs)));
        }
        passes = kMaxPasses;
    }
    shape.passes = uint32_t(passes);
    return true;
}

void CudaBackend::report(const FrameShape& shape, const FrameGraph& graph, const FrameOptions& options,
                         const FrameCounters& first, FrameResult& result)
{
    const FrameCounters& c = *m_counters.data;
    result = {};
    for (uint32_t e = 0; e < shape.eye_count; ++e) {
        EyeCounts& eye = result.eyes[e];
        eye.groups_tested = m_scene.model().params.group_count - first.groups_kept[e];
        result.groups_kept += first.groups_kept[e];
        eye.anchors_tested = first.anchors_tested[e];
        eye.anchors_visible = c.anchors_visible[e];
        eye.anchors_decoded = !shape.merged ? c.anchors_visible[e] : e == 0 ? c.anchors_listed : 0;
        eye.gaussians_alive = c.gaussians[e];
        eye.gaussians_visible = c.splats[e];
        eye.gaussians_dropped = c.dropped[e];
        eye.pairs = c.pairs[e];
        eye.blend_evaluations = c.evaluations[e];
    }
    if (shape.keeps)
        m_reuse.addCounts(shape.eye_count, result);
    if (options.reuse.order)
        result.order_moves = shape.orders && m_order.known() ? c.long_keys : c.pairs[0] + c.pairs[1];
    result.cache_bytes = m_reuse.bytes() + m_cut.bytes() + m_order.bytes();
    result.times = graph.times();
    result.bytes_resident = m_budget.used;
    result.passes = shape.passes;
}

void CudaBackend::render(const EyeParams* eyes, uint32_t eye_count, const FrameOptions& options, float* const* images,
                         FrameResult& result)
{
    FrameShape shape = shapeOf(eyes, eye_count, options);
    if (shape.exact && !m_scene.exactLoaded()) {
        m_graphs.clear();
        m_arena.release(); // what frames in `fast` took may be what the model in fp32 needs
        m_scene.loadExact(m_stream);
        m_free = freeForFrames();
    }
    if (m_scene.fastPossible())
        m_scene.useAppearance(options.appearance, m_stream);
    EyeParams chosen[kMaxEyes];
    m_lag.follow(m_scene.host(), options, eyes, eye_count, chosen);
    beginReuse(shape, options);
    beginCut(shape, chosen, options);
    beginOrder(options);
    choosePasses(shape);
    FrameGraph* graph = nullptr;
    uint32_t tries = 0;
    FrameCounters first{};
    do {
        ++tries;
        shape.keeps = shape.keeps && shape.passes == 1;          // of a pass's entries only some would be decoded
        shape.orders = options.reuse.order && shape.passes == 1; // where passes end would show
        shape.grid.slab_bits = slabBits(m_capacity.slots);
        graph = &graphFor(shape, options);
        graph->launch(shape.eyes, chosen, options, &m_reuse.job(), &m_cut.args(), m_order.job(), m_stream);
        GSC_CUDA_CHECK(cudaStreamSynchronize(m_stream.handle));
        if (tries == 1)
            first = *m_counters.data;
        if (shape.keeps)
            m_reuse.endTry();
    } while (growAfterOverflow(shape));
    const FrameCounters& c = *m_counters.data;
    m_splats = c.all_slots;
    m_pairs = c.pairs[0] + c.pairs[1];
    for (uint32_t e = 0; e < eye_count; ++e)
        if (images != nullptr && images[e] != nullptr)
            GSC_CUDA_CHECK(cudaMemcpyAsync(images[e], m_buffers.image[e], shape.pixels(e) * 3 * sizeof(float),
                                           cudaMemcpyDeviceToHost, m_stream.handle));
    report(shape, *graph, options, first, result);
    m_lod_bias = options.lod_bias;
    if (shape.orders)
        m_order.end();
    else
        m_order.forget();
    result.repeats = tries - 1;
    GSC_CUDA_CHECK(cudaStreamSynchronize(m_stream.handle));
}

} // namespace

std::unique_ptr<Backend> makeCudaBackend()
{
    return std::make_unique<CudaBackend>();
}

} // namespace gsc
