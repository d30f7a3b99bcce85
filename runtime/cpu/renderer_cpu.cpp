// SPDX-License-Identifier: Apache-2.0
#include "runtime/cpu/renderer_cpu.h"

#include "runtime/cpu/frame_cpu.h"
#include "runtime/cpu/frame_thread.h"
#include "runtime/backend/frame_checks.h"

#include "kernels/threads/stopwatch.h"
#include "runtime/reuse/coarse/coarse_cpu.h"
#include "runtime/view/lod_lag.h"
#include "runtime/reuse/reuse_cpu.h"
#include "runtime/cpu/frame/paint_cpu.h"
#include "runtime/cpu/stereo_cpu.h"

#include <algorithm>

namespace gsc {

namespace {

class CpuRenderer final : public Renderer {
public:
    // Kept Gaussians and coarse copies may each take a quarter of the machine's memory, unless the options of a frame
    // say otherwise: more than the visible anchors need, with room for the model, the frame and other programs.
    explicit CpuRenderer(int threads)
        : m_frame(threads), m_reuse(m_frame.workers, cpuFacts(1).memory_bytes / 4),
          m_coarse(cpuFacts(1).memory_bytes / 4), m_thread([this](auto&&... frame) { draw(frame...); })
    {
    }

    [[nodiscard]] DeviceId id() const override { return {"cpu", 0}; }
    [[nodiscard]] bool onHost() const override { return true; }
    [[nodiscard]] DeviceFacts device() const override { return cpuFacts(uint32_t(m_frame.workers.count())); }
    [[nodiscard]] Tier tierOf(Tier) const override { return Tier::Exact; } // a CPU computes everything in fp32

    using Renderer::load;
    void load(const ModelView& model) override
    {
        checkModel(model);
        m_thread.clear();
        m_frame.model = {}; // the model stays empty unless everything below succeeds
        m_reuse.load(model);
        m_coarse.load(model);
        dropCaches();
        m_frame.load(model);
        m_model_bytes = modelBytes(model);
    }

    void dropCaches() override
    {
        m_thread.clear();
        m_reuse.clear();
        m_coarse.clear();
        m_lag.clear();
    }

    uint64_t submit(const FrameRequest& request) override
    {
        checkRequest(m_frame.model, request, true);
        return m_thread.submit(request);
    }
    FrameState wait(uint64_t ticket, FrameResult& result, std::chrono::nanoseconds most) override
    {
        return m_thread.wait(ticket, result, most);
    }

private:
    void draw(const EyeParams* eyes, uint32_t eye_count, const FrameOptions& options, float* const* images,
              FrameResult& result, const DepthRows<float>* depths)
    {
        Stopwatch total;
        EyeParams chosen[kMaxEyes];
        m_lag.follow(m_frame.model, options, eyes, eye_count, chosen);
        const RasterConstants rules = rasterConstants(*m_frame.model.params, options.near_z);
        if (options.detail > 0) {
            m_reuse.skipFrame();
            drawCoarse(eyes, chosen, eye_count, options, result);
        } else if (options.reuse.policy == ReusePolicy::None) {
            m_reuse.skipFrame();
            m_frame.select(chosen, eye_count, options, result);
            m_frame.decode(eyes, eye_count, options, result);
        } else {
            m_frame.select(chosen, eye_count, options, result);
            m_frame.checkSlots(m_frame.selected.group_count * kGroupSize);
            m_reuse.run({eyes, eye_count, options, rules, m_frame.selected, m_frame.visible.data(),
                         m_frame.visible_count, m_frame.states, m_frame.stores, m_frame.bias},
                        result);
        }
        for (uint32_t e = 0; e < eye_count; ++e)
            rasterize(e, eyes[e], options, rules, imageOf(e, eyes[e], images), depths[e], result);
        result.times.total = total.lap();
        result.bytes_resident = m_model_bytes + m_frame.bytes() + m_image.bytes() + m_reuse.bytes() + m_coarse.bytes();
    }

    // Draws a frame with detail. Levels are chosen by the distance from `chosen`, which may lag behind `eyes`.
    void drawCoarse(const EyeParams* eyes, const EyeParams* chosen, uint32_t eye_count, const FrameOptions& options,
                    FrameResult& result)
    {
        const size_t seen = m_frame.selectGroups(chosen, eye_count, options, result);
        const CpuCoarseFrame frame{eyes,
                                   chosen,
                                   eye_count,
                                   options,
                                   m_frame.workers,
                                   m_frame.states,
                                   m_frame.bias,
                                   m_frame.selected.seen.data(),
                                   seen};
        const std::vector<SeenGroup>& near = m_coarse.choose(frame, result);
        m_frame.selectAnchors(chosen, eye_count, options, near, result);
        m_frame.decode(eyes, eye_count, options, result, m_coarse.blocks());
        m_coarse.draw(frame, m_frame.stores, m_frame.blocks(), m_frame.capacity, result);
    }

    // Lists the splats of eye `e` from the blocks that the kind of frame has filled.
    void list(uint32_t e, const EyeParams& eye, const FrameOptions& options, FrameResult& result)
    {
        if (options.reuse.policy != ReusePolicy::None)
            m_frame.list(e, eye, m_reuse.groups().size(), m_reuse.groups().data(), result);
        else if (options.detail > 0)
            m_frame.list(e, eye, m_frame.blocks() + m_coarse.blocks(), nullptr, result, m_frame.blocks());
        else
            m_frame.list(e, eye, m_frame.blocks(), nullptr, result);
    }

    // Returns the caller's image of eye `e`, or one of our own if the caller wants none.
    float* imageOf(uint32_t e, const EyeParams& eye, float* const* images)
    {
        if (images[e] != nullptr)
            return images[e];
        m_image.reserve(size_t(eye.width) * eye.height * 3);
        return m_image.data();
    }

    // Adds the counts of all workers. Returns true if a Gaussian of the eye has an opacity above zero.
    bool addCounts(uint32_t e, EyeCounts& eye) const
    {
        bool any_positive = false;
        for (const DecodeState& state : m_frame.states) {
            eye.gaussians_alive += state.alive[e];
            eye.gaussians_visible += state.visible[e];
            eye.gaussians_dropped += state.dropped[e];
            eye.anchors_decoded += state.decoded[e];
            eye.anchors_reused += state.reused[e];
            eye.anchors_overdue += state.overdue[e];
            any_positive |= state.any_positive[e];
        }
        return any_positive;
    }

    void rasterize(uint32_t e, const EyeParams& eye, const FrameOptions& options, const RasterConstants& rules,
                   float* image, const DepthRows<float>& depth, FrameResult& result)
    {
        Stopwatch watch;
        if (addCounts(e, result.eyes[e])) {
            list(e, eye, options, result);
            (void)watch.lap();
            BlendArgs args = m_frame.listed(eye, rules);
            std::copy_n(options.background, 3, args.background);
            args.image = image;
            args.depth = depth;
            args.sorted = m_frame.sort.keys[0].data();
            args.columns = options.columns;
            args.cost = options.view == FrameView::Cost;
            args.lens = options.lens[e];
            result.eyes[e].blend_evaluations = blendCpu(args, m_frame.workers);
        } else {
            blendNothing(eye.width, eye.height, emptyColor(options), image, depth, options.columns);
        }
        blendHidden(eye.width, eye.height, options.lens[e], image, depth, options.columns);
        result.times.blend += watch.lap();
    }

    CpuFrame m_frame;
    uint64_t m_model_bytes = 0;
    CpuReuse m_reuse;
    CpuCoarse m_coarse;
    LodLag m_lag;
    Buffer<float> m_image; // image of an eye for which the caller wants none
    FrameThread m_thread;  // declared last: the thread uses the members above
};

class ReferenceRenderer final : public Renderer {
public:
    ReferenceRenderer() : m_thread([this](auto&&... frame) { renderReference32(m_model, frame...); }) {}

    [[nodiscard]] DeviceId id() const override { return {"cpu-reference", 0}; }
    [[nodiscard]] bool onHost() const override { return true; }
    [[nodiscard]] DeviceFacts device() const override { return cpuFacts(1); }
    [[nodiscard]] Tier tierOf(Tier) const override { return Tier::Exact; } // a CPU computes everything in fp32

    using Renderer::load;
    void load(const ModelView& model) override
    {
        checkModel(model);
        m_thread.clear();
        m_model = model;
    }

    void dropCaches() override { m_thread.clear(); }

    uint64_t submit(const FrameRequest& request) override
    {
        checkRequest(m_model, request, true);
        const FrameOptions& options = request.options;
        if (options.reuse.policy != ReusePolicy::None || options.detail > 0 || options.lod_hysteresis > 0)
            throw Error(ErrorCode::Unsupported, "backend cpu-reference", "keeps nothing from frame to frame",
                        "reuse policy none, a detail and a LOD hysteresis of 0", "use the backend cpu or cuda");
        return m_thread.submit(request);
    }
    FrameState wait(uint64_t ticket, FrameResult& result, std::chrono::nanoseconds most) override
    {
        return m_thread.wait(ticket, result, most);
    }

private:
    ModelView m_model{};
    FrameThread m_thread; // declared last: the thread uses the members above
};

} // namespace

std::unique_ptr<Renderer> makeCpuRenderer(CpuPath path, int threads)
{
    if (path == CpuPath::Reference)
        return std::make_unique<ReferenceRenderer>();
    return std::make_unique<CpuRenderer>(threads);
}

} // namespace gsc
