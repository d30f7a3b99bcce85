// SPDX-License-Identifier: Apache-2.0
#include "runtime/cuda/renderer_cuda.h"

#include "runtime/cuda/ceilings_cuda.h"
#include "runtime/cuda/flight.h"
#include "kernels/present/false_colour.h"
#include "runtime/backend/frame_checks.h"
#include "runtime/view/lod_lag.h"
#include "runtime/reuse/coarse/coarse_cuda.h"
#include "runtime/reuse/reuse_cuda.h"

#include <algorithm>
#include <optional>

namespace gsc {

namespace {

constexpr size_t kGraphs = 8; // most graphs that each flight keeps for later frames

class CudaRenderer final : public Renderer {
public:
    CudaRenderer(int ordinal, const RendererOptions& options)
        : m_device(ordinal), m_budget{options.memory_bytes, 0}, m_scene(m_budget, options.threads),
          m_first_picture(options.first_picture), m_coarse(m_budget, options.coarse_unlimited)
    {
        m_budget.used = m_device.contextBytes();
    }

    // makes the device current again, because the members then free memory on it
    ~CudaRenderer() override { (void)cudaSetDevice(m_device.ordinal()); }

    [[nodiscard]] DeviceId id() const override { return {"cuda", m_device.ordinal()}; }
    [[nodiscard]] DeviceFacts device() const override { return m_device.facts(); }
    [[nodiscard]] bool onHost() const override { return false; }
    [[nodiscard]] DeviceCeilings ceilings() override
    {
        m_device.use();
        return measureCudaCeilings(m_device.limits().processors,
                                   m_budget.limit == 0 ? UINT64_MAX
                                                       : m_budget.limit - std::min(m_budget.limit, m_budget.used));
    }
    [[nodiscard]] Tier tierOf(Tier asked) const override
    {
        return asked == Tier::Exact || !m_scene.fastPossible() ? Tier::Exact : Tier::Fast;
    }

    using Renderer::load;
    void load(const ModelView& model) override
    {
        m_device.use();
        checkModel(model);
        for (Flight& flight : m_flights)
            flight.ticket = 0;
        giveFramesBack(); // frees the memory of frames, which a larger model may need
        m_reuse.drop();
        m_coarse.release();
        try {
            guarded([&] {
                // a model that tier fast cannot draw is drawn in tier exact, which needs all of the model at once
                if (m_first_picture && canDecodeFast(model))
                    m_scene.loadFrame(model, m_stream);
                else
                    m_scene.load(model, m_stream);
                if (m_scene.fastPossible())
                    m_coarse.loadKernels(m_scene);
            });
        } catch (...) {
            m_scene.forget();
            throw;
        }
        m_capacity = {};
        forgetLoad();
        m_lag.clear();
    }

    void dropCaches() override
    {
        m_device.use();
        m_lag.clear();
        for (Flight& flight : m_flights)
            flight.graphs.clear();
        m_reuse.drop();
        m_coarse.release();
        forgetLoad(); // later frames are drawn as after load(), but in buffers that have grown already
    }

    uint64_t submit(const FrameRequest& request) override;
    FrameState wait(uint64_t ticket, FrameResult& result, std::chrono::nanoseconds most) override;
    [[nodiscard]] void* readyEvent(uint64_t ticket) const override
    {
        return const_cast<CudaRenderer*>(this)->flightOf(ticket).ready.handle;
    }

private:
    // Calls `body`; an error that only a broken context causes marks the device as lost.
    template <typename Body>
    auto guarded(const Body& body) -> decltype(body())
    {
        try {
            return body();
        } catch (const Error& error) {
            if (error.code() == ErrorCode::Device)
                m_device.noteLost();
            throw;
        }
    }
    uint64_t begin(const FrameRequest& request);
    Flight& flightOf(uint64_t ticket)
    {
        for (Flight& flight : m_flights)
            if (flight.ticket == ticket && ticket != 0)
                return flight;
        throwNotInFlight(ticket);
    }
    Flight& freeFlight()
    {
        checkInFlight(size_t(std::ranges::count_if(m_flights, [](const Flight& f) { return f.ticket != 0; })));
        return m_flights[0].ticket == 0 ? m_flights[0] : m_flights[1];
    }

    [[nodiscard]] const FrameReuse* keeperOf(const FrameShape& shape) const
    {
        return shape.coarse ? static_cast<const FrameReuse*>(&m_coarse) : shape.uses_reuse ? &m_reuse : nullptr;
    }
    // with several passes, each pass would decode only some of the entries
    static bool reuses(const FrameShape& shape, uint32_t passes) { return shape.uses_reuse && passes == 1; }
    [[nodiscard]] uint64_t frameBytes(FrameShape shape, const FrameCapacity& capacity) const;
    [[nodiscard]] uint32_t gapsOf(const FrameShape& shape, uint32_t slots, uint32_t passes) const
    {
        const CudaLimits& limits = m_device.limits();
        if (shape.exact)
            return decodeExactGaps(m_scene.exactWeights() != nullptr, limits.processors, limits.shared_bytes, slots);
        return decodeFastGaps(limits.processors, slots) +
               (reuses(shape, passes) ? drawKeptGaps(limits.processors, slots) : 0) +
               (shape.coarse ? coarseDrawGaps(limits.processors, slots) : 0);
    }
    [[nodiscard]] uint64_t freeForFrames() const;
    [[nodiscard]] FrameRoom roomFor(const FrameShape& shape) const;
    void planCapacity(const FrameShape& shape, const FrameRoom& room);
    void forgetLoad() // makes the next frame be planned as the first one of a model
    {
        m_free = freeForFrames();
        m_history.forget();
        m_planned.reset();
    }
    void giveFramesBack() // frees the buffers and graphs of all frames
    {
        for (Flight& flight : m_flights)
            flight.graphs.clear();
        m_arena.release();
    }
    void bringAnchors(const EyeParams& eye, bool all);
    // Returns the arguments with which the frame's graph is launched.
    const FrameNow& beginNow(const FrameShape& shape, const FrameNow& plain, const FrameRequest& request,
                             uint32_t flight);
    const FrameNow& beginCoarse(const FrameShape& shape, const FrameRequest& request);
    FrameGraph& graphFor(const FrameShape& shape, const FrameNow& now, uint32_t flight);
    void end(Flight& flight);

    CudaDevice m_device;   // declared before all members that hold memory of it
    MemoryBudget m_budget; // declared before all members that give memory back to it
    CudaStream m_stream, m_copies;
    Flight m_flights[kFramesInFlight] = {Flight(m_budget), Flight(m_budget)};
    DeviceScene m_scene;
    bool m_first_picture;
    CudaReuse m_reuse{m_budget};
    CudaCoarse m_coarse;
    DeviceArena m_arena{m_budget};
    LodLag m_lag;
    FrameNow m_now{}; // arguments of the frame submitted last
    uint64_t m_last = 0;
    struct Begun { // settings for which m_now was made
        uint64_t ticket = 0;
        uint32_t eye_count = 0;
        ReusePolicy policy = ReusePolicy::None;
        float detail = 0;

        bool operator==(const Begun&) const = default;
    };
    Begun m_begun;
    uint64_t m_pictures = 0; // most bytes that the pictures for the host of one frame have taken
    FrameBuffers m_buffers{};
    FrameCapacity m_capacity;
    FrameHistory m_history;
    struct Plan { // settings for which the capacity was planned last
        bool exact, uses_reuse, coarse;
        uint32_t eye_count, lists, bins;
        uint64_t bytes;

        bool operator==(const Plan&) const = default;
    };
    std::optional<Plan> m_planned;
    uint64_t m_free = 0; // bytes of device memory that frames may take
};

// Bytes of a frame's buffers for any number of slabs that may be chosen.
uint64_t CudaRenderer::frameBytes(FrameShape shape, const FrameCapacity& capacity) const
{
    shape.grid.slab_bits = slabBits(capacity.slots);
    ArenaLayout counted(nullptr);
    layOutFrame(counted, m_scene, shape, capacity, m_device.limits());
    return counted.bytes();
}

// Bytes of device memory that the model and kept Gaussians leave free, less a sixteenth as reserve for others.
uint64_t CudaRenderer::freeForFrames() const
{
    size_t left = 0, total = 0;
    GSC_CUDA_CHECK(cudaMemGetInfo(&left, &total));
    left += m_arena.bytes();
    return left - left / 16;
}

FrameRoom CudaRenderer::roomFor(const FrameShape& shape) const
{
    // every flight counts with the largest pictures so far, so that plans do not depend on which flight has had them
    uint64_t others = m_budget.used - m_arena.bytes() + kFramesInFlight * m_pictures;
    for (const Flight& flight : m_flights)
        others -= flight.pictureBytes();
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
    room.gaps = [this, &shape](uint32_t slots, uint32_t passes) { return gapsOf(shape, slots, passes); };
    room.bytes_of = [this, &shape](const FrameCapacity& capacity, uint32_t passes) {
        FrameShape cut = shape;
        cut.passes = passes;
        return frameBytes(cut, capacity);
    };
    return room;
}

// Plans the capacity once for each kind of frame and amount of memory.
void CudaRenderer::planCapacity(const FrameShape& shape, const FrameRoom& room)
{
    const Plan plan{shape.exact,   shape.uses_reuse, shape.coarse, shape.eye_count,
                    shape.lists(), shape.bins(),     room.bytes};
    if (m_planned == plan)
        return;
    m_planned = plan;
    m_capacity = plannedCapacity(room, m_capacity);
}

// Uploads anchors before a frame. The first frame waits for those near the eye; later ones take what has been read so
// far, and stay fast. `all`: waits for all anchors.
void CudaRenderer::bringAnchors(const EyeParams& eye, bool all)
{
    using namespace std::chrono_literals;
    using Clock = ChunkReader::Clock;
    constexpr Clock::duration kFirst = 200ms, kLater = 4ms, kPatience = 200us;
    const bool first = m_scene.runsThere() == 0;
    do
        m_scene.bring(eye, all ? Clock::time_point::max() : Clock::now() + (first ? kFirst : kLater),
                      first ? kFirst : kPatience);
    while (m_scene.runsThere() == 0 && !m_scene.whole());
}

// Prepares reuse or coarse copies, whose memory is reserved before that of frames: frames get the rest.
const FrameNow& CudaRenderer::beginNow(const FrameShape& shape, const FrameNow& plain, const FrameRequest& request,
                                       uint32_t flight)
{
    const FrameOptions& options = request.options;
    const Begun begun{request.repeats, shape.eye_count, options.reuse.policy, options.detail};
    const bool again = request.repeats != 0 && request.repeats == m_last && begun == m_begun;
    m_begun = {m_last + 1, shape.eye_count, options.reuse.policy, options.detail};
    if (!again) {
        m_now = plain;
        m_lag.follow(m_scene.host(), options, request.eyes.data(), shape.eye_count, m_now.level_eyes);
        if (shape.merged)
            mergedCenter(m_now.eyes, m_now.look_from);
        m_now.lod_bias = options.lod_bias;
        m_now.lod_fade = options.lod_fade;
        setFoveation(options.foveation, m_now);
        if (!shape.uses_reuse)
            m_reuse.skipFrame();
    }
    if (shape.coarse)
        return again ? m_coarse.beginAgain() : beginCoarse(shape, request);
    if (!shape.uses_reuse)
        return m_now;
    if (again)
        return m_reuse.beginAgain(flight);
    if (m_reuse.needsMemory(options.reuse, shape.eye_count)) {
        giveFramesBack();
        m_reuse.prepare(m_scene, options.reuse, shape.eye_count);
        m_free = freeForFrames();
    }
    return m_reuse.begin(m_now, shape.eye_count, options, flight, m_stream);
}

// Prepares coarse copies. They get a share of the memory that the largest pictures so far leave, so that plans do not
// depend on which flight has had them.
const FrameNow& CudaRenderer::beginCoarse(const FrameShape& shape, const FrameRequest& request)
{
    if (m_coarse.needsMemory()) {
        giveFramesBack();
        uint64_t pictures = kFramesInFlight * m_pictures;
        for (const Flight& flight : m_flights)
            pictures -= std::min(pictures, flight.pictureBytes());
        m_coarse.prepare(m_scene, pictures);
        m_free = freeForFrames();
    }
    return m_coarse.begin(m_now, shape.eye_count, request.options, request.repeats != 0, m_device.limits().processors,
                          m_stream);
}

FrameGraph& CudaRenderer::graphFor(const FrameShape& shape, const FrameNow& now, uint32_t flight)
{
    if (m_arena.reserve(frameBytes(shape, m_capacity), "a frame"))
        for (Flight& any : m_flights)
            any.graphs.clear();
    // note: the arena is laid out anew for every shape, which moves the buffers that other graphs use; that is
    // allowed, because each graph keeps its own addresses and frames do not overlap
    ArenaLayout layout(m_arena.get());
    m_buffers = layOutFrame(layout, m_scene, shape, m_capacity, m_device.limits());
    const FrameJob job{m_scene, shape, now, m_capacity, m_buffers, m_device.limits(), flight};
    Flight& own = m_flights[flight];
    const auto found =
        std::find_if(own.graphs.begin(), own.graphs.end(), [&](const auto& graph) { return graph->fits(job); });
    if (found != own.graphs.end()) {
        std::rotate(own.graphs.begin(), found, found + 1);
    } else {
        own.graphs.push_front(std::make_unique<FrameGraph>(job, keeperOf(shape), own.counters.data, m_stream));
        if (own.graphs.size() > kGraphs)
            own.graphs.pop_back();
    }
    return *own.graphs.front();
}

uint64_t CudaRenderer::submit(const FrameRequest& request)
{
    return guarded([&] { return begin(request); });
}

uint64_t CudaRenderer::begin(const FrameRequest& request)
{
    m_device.use();
    checkRequest(m_scene.host(), request, false);
    Flight& flight = freeFlight();
    const auto index = uint32_t(&flight - m_flights);
    const FrameOptions& options = request.options;
    FrameNow plain{};
    std::ranges::copy(request.eyes, plain.eyes);
    FrameShape shape =
        frameShape(*m_scene.host().params, tierOf(options.tier), uint32_t(request.eyes.size()), options, plain.eyes);
    plain.columns = options.columns;
    for (size_t e = 0; e < request.eyes.size(); ++e) {
        plain.lenses[e] = eyeLens(plain.eyes[e]);
        plain.bands[e] = eyeBand(plain.eyes[e], options.columns);
    }
    shape.depths = std::ranges::any_of(request.targets, &FrameTarget::hasDepth);
    // a frame that repeats another one draws the same anchors, so none are uploaded before it
    if (!m_scene.whole() && (request.repeats == 0 || request.repeats != m_last))
        bringAnchors(plain.eyes[0], shape.exact);
    plain.run_count = m_scene.runsThere();
    flight.anchors_absent = m_scene.anchorsAbsent();
    if (shape.exact && !m_scene.exactLoaded()) {
        m_coarse.release();
        giveFramesBack(); // frees the memory of frames, which the fp32 model may need
        m_scene.loadExact(m_stream);
        m_free = freeForFrames();
    }
    if (paintsGaussians(shape.view) && m_scene.origins() == nullptr) {
        m_coarse.release();
        giveFramesBack();
        m_scene.loadOrigins(m_stream);
        m_free = freeForFrames();
    }
    if (m_scene.fastPossible())
        m_scene.useAppearance(options.appearance, m_stream);
    if (const uint64_t bytes = flight.setTargets(request); bytes > m_pictures) {
        m_pictures = bytes;
        giveFramesBack(); // the coarse copies' share depends on the size of pictures, which has grown
    }
    flight.placePictures();
    const FrameNow& now = beginNow(shape, plain, request, index);
    const FrameRoom room = roomFor(shape);
    m_history.begin(m_last + 1, request.repeats, room, m_capacity);
    planCapacity(shape, room);
    const uint32_t passes = m_history.passes(room, m_capacity);
    shape.passes = passes;
    shape.uses_reuse = reuses(shape, passes);
    shape.grid.slab_bits = m_history.slabBitsFor(m_capacity);
    FrameGraph& graph = graphFor(shape, now, index);
    flight.shape = shape;
    graph.launch(now, flight.start, m_stream);
    flight.present(m_buffers, m_stream);
    flight.ended = false;
    return flight.ticket = ++m_last;
}

FrameState CudaRenderer::wait(uint64_t ticket, FrameResult& result, std::chrono::nanoseconds most)
{
    Flight& flight = flightOf(ticket);
    try {
        m_device.use();
        if (!flight.ended && !guarded([&] { return flight.passed(most); }))
            return FrameState::Pending;
        for (Flight& older : m_flights)
            if (older.ticket != 0 && older.ticket < ticket && !older.ended)
                end(older);
        if (!flight.ended)
            end(flight);
        if (flight.error)
            guarded([&] { std::rethrow_exception(flight.error); });
    } catch (...) {
        flight.ticket = 0;
        throw;
    }
    flight.ticket = 0;
    result = flight.result;
    return flight.overflowed ? FrameState::Overflowed : FrameState::Done;
}

// Ends a frame that has been drawn, after those before it. An error is stored; wait() for that frame throws it.
void CudaRenderer::end(Flight& flight)
{
    const FrameCounters& c = *flight.counters.data;
    flight.overflowed = c.overflow != 0;
    m_history.add({flight.ticket,
                   {c.anchors_listed, c.most_slots, c.most_pairs},
                   flight.overflowed,
                   c.all_slots,
                   c.pairs[0] + c.pairs[1],
                   flight.shape.passes});
    flight.fillResult();
    FrameResult& result = flight.result;
    if (flight.shape.uses_reuse)
        m_reuse.addCounts(uint32_t(&flight - m_flights), flight.shape.eye_count, result);
    if (flight.shape.coarse)
        addCoarseCounts(c.coarse, flight.shape.eye_count, result);
    result.cache_bytes = m_reuse.bytes() + m_coarse.bytes();
    result.bytes_resident = m_budget.used;
    result.passes = flight.shape.passes;
    result.anchors_absent = flight.anchors_absent;
    flight.error = flight.overflowed ? nullptr : flight.copyToHost(m_copies);
    flight.ended = true;
}

} // namespace

std::unique_ptr<Renderer> makeCudaRenderer(int ordinal, const RendererOptions& options)
{
    return std::make_unique<CudaRenderer>(ordinal, options);
}

} // namespace gsc
