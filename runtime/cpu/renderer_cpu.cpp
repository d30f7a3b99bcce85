// SPDX-License-Identifier: Apache-2.0
#include "runtime/cpu/renderer_cpu.h"

#include "runtime/cpu/frame_thread.h"
#include "runtime/frame_checks.h"

#include "kernels/blend/blend.h"
#include "kernels/threads/parallel.h"
#include "kernels/threads/stopwatch.h"
#include "kernels/math/anchor.h"
#include "kernels/sort/sort.h"
#include "runtime/view/lod_lag.h"
#include "runtime/reuse/reuse_cpu.h"
#include "runtime/cpu/paint_cpu.h"
#include "runtime/cpu/stereo_cpu.h"

#include <algorithm>

namespace gsc {

namespace {

class CpuRenderer final : public Renderer {
public:
    // Entries may take a quarter of the machine unless a frame's options say otherwise: more than a visible set needs, and
    // room for the model, the frame and other programs.
    explicit CpuRenderer(int threads)
        : m_workers(threads), m_states(size_t(m_workers.count())), m_reuse(m_workers, cpuFacts(1).memory_bytes / 4),
          m_thread([this](auto&&... frame) { draw(frame...); })
    {
    }

    [[nodiscard]] DeviceId id() const override { return {"cpu", 0}; }
    [[nodiscard]] bool onHost() const override { return true; }
    [[nodiscard]] DeviceFacts device() const override { return cpuFacts(uint32_t(m_workers.count())); }
    [[nodiscard]] Tier tierOf(Tier) const override { return Tier::Exact; } // fp32 throughout

    using Renderer::load;
    void load(const ModelView& model) override
    {
        checkModel(model);
        m_thread.clear();
        m_model = {}; // unless all of it succeeds
        for (DecodeState& state : m_states)
            reserveDecode(model, state.scratch);
        m_reuse.load(model);
        dropCaches();
        m_model = model;
        m_model_bytes = modelBytes(model);
    }

    void dropCaches() override
    {
        m_thread.clear();
        m_reuse.clear();
        m_lag.clear();
    }

    uint64_t submit(const FrameRequest& request) override
    {
        checkRequest(m_model, request, true);
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
        const RasterConstants rules = rasterConstants(*m_model.params, options.near_z);
        const size_t visible = select(eyes, eye_count, options, rules, result);
        for (DecodeState& state : m_states)
            state.clearCounts();
        if (options.reuse.policy == ReusePolicy::None) {
            m_reuse.skipFrame();
            decodeAndProject(eyes, eye_count, options, rules, visible, result);
        } else {
            checkSlots(m_select.group_count * kGroupSize);
            m_reuse.run(
                {eyes, eye_count, options, rules, m_select, m_visible.data(), visible, m_states, m_stores, m_bias},
                result);
        }
        addCounts(eye_count, result);
        for (uint32_t e = 0; e < eye_count; ++e)
            rasterize(e, eyes[e], options, rules, visible, imageOf(e, eyes[e], images), depths[e], result);
        result.times.total = total.lap();
        result.bytes_resident = m_model_bytes + frameBytes();
    }

    // The caller's image, or one of our own where it wants none.
    float* imageOf(uint32_t e, const EyeParams& eye, float* const* images)
    {
        if (images[e] != nullptr)
            return images[e];
        m_image.reserve(size_t(eye.width) * eye.height * 3);
        return m_image.data();
    }

    size_t select(const EyeParams* eyes, uint32_t eye_count, const FrameOptions& options, const RasterConstants& rules,
                  FrameResult& result)
    {
        Stopwatch watch;
        EyeParams chosen[kMaxEyes];
        m_lag.follow(m_model, options, eyes, eye_count, chosen);
        const SelectArgs args{&m_model, chosen, eye_count, rules, options.lod_bias, options.lod_fade, options.columns};
        SelectCounts counts{};
        const size_t visible = selectCpu(args, m_workers, m_select, m_visible, counts);
        for (uint32_t e = 0; e < eye_count; ++e) {
            EyeCounts& eye = result.eyes[e];
            eye.groups_tested = counts.groups_tested[e];
            eye.anchors_tested = counts.anchors_tested[e];
            eye.anchors_visible = counts.anchors_visible[e];
        }
        result.times.select = watch.lap();
        return visible;
    }

    [[nodiscard]] uint32_t blockCapacity() const { return kDecodeBlock * m_model.params->n_offsets; }

    // What the workers counted.
    void addCounts(uint32_t eye_count, FrameResult& result) const
    {
        for (const DecodeState& state : m_states)
            for (uint32_t e = 0; e < eye_count; ++e) {
                EyeCounts& eye = result.eyes[e];
                eye.gaussians_alive += state.alive[e];
                eye.gaussians_visible += state.visible[e];
                eye.gaussians_dropped += state.dropped[e];
                eye.anchors_decoded += state.decoded[e];
                eye.anchors_reused += state.reused[e];
                eye.anchors_overdue += state.overdue[e];
            }
    }

    // Splats are numbered with 32 bits.
    void checkSlots(size_t anchors) const
    {
        if (anchors * m_model.params->n_offsets > UINT32_MAX)
            throw Error(ErrorCode::OutOfMemory,
                        formatString("frame: %zu visible anchors of %u Gaussians each, expected fewer than 2^32 "
                                     "Gaussians; raise the LOD or look at less of the model",
                                     anchors, m_model.params->n_offsets));
    }

    // Both stages block by block, so that Gaussians never leave the cache.
    void decodeAndProject(const EyeParams* eyes, uint32_t eye_count, const FrameOptions& options,
                          const RasterConstants& rules, size_t visible, FrameResult& result)
    {
        Stopwatch watch;
        const size_t blocks = (visible + kDecodeBlock - 1) / kDecodeBlock;
        const size_t slots = blocks * blockCapacity();
        checkSlots(blocks * kDecodeBlock);
        for (uint32_t e = 0; e < eye_count; ++e) {
            m_stores[e].reserve(blocks, slots);
            result.eyes[e].anchors_decoded = result.eyes[e].anchors_visible;
        }
        EyeParams middle{};
        const bool merged = decodesMerged(options, eye_count);
        if (merged) {
            mergedCenter(eyes, middle.center);
            result.eyes[0].anchors_decoded = visible;
            result.eyes[1].anchors_decoded = 0;
            for (DecodeState& state : m_states)
                reserveDecode(m_model, state.gathered);
        }
        const DecodeArgs args = prepareDecode(m_model, merged ? &middle : eyes, merged ? 1 : eye_count,
                                              m_visible.data(), visible, options.appearance, m_bias);
        m_workers.run(blocks, 1, [&](size_t begin, size_t end, int worker) {
            for (size_t block = begin; block < end; ++block)
                runBlock(args, eyes, eye_count, rules, options, block, m_states[size_t(worker)]);
        });
        addShares(m_states, watch.lap(), result.times);
    }

    // More eyes than `args` decodes for: both draw what it decodes.
    void runBlock(const DecodeArgs& args, const EyeParams* eyes, uint32_t eye_count, const RasterConstants& rules,
                  const FrameOptions& options, size_t block, DecodeState& state)
    {
        Stopwatch watch;
        const size_t first = block * kDecodeBlock;
        const auto count = uint32_t(std::min<size_t>(kDecodeBlock, args.visible_count - first));
        const bool merged = args.eye_count < eye_count;
        if (merged)
            decodeForBothEyes(args, first, count, state.scratch);
        else
            decodeBlockCpu(args, first, count, state.scratch);
        state.decode_ms += watch.lap();
        for (uint32_t e = 0; e < eye_count; ++e) {
            const GaussianBlock& gaussians =
                merged ? gaussiansOfEye(state.scratch.blocks[0], args.visible + first, count, e,
                                        m_model.params->n_offsets, state.gathered.blocks[e])
                       : state.scratch.blocks[e];
            projectInto(m_stores[e], block, block * blockCapacity(), {eyes + e, rules, nullptr, options.columns},
                        gaussians, e, state);
            if (paintsGaussians(options.view))
                paintBlock(m_stores[e], block, args.visible + first, options.view);
        }
        state.project_ms += watch.lap();
    }

    void paintBlock(SplatStore& store, size_t block, const VisibleAnchor* visible, FrameView view) const
    {
        const size_t first = block * blockCapacity();
        const FalseColour fresh = ageColour(0); // nothing is kept
        paintSplats(store.splats.data() + first, store.origins.data() + first, store.counts[block],
                    m_model.params->n_offsets, [&](uint32_t entry) {
                        return view == FrameView::Age ? fresh : chunkColour(m_model, visible[entry].chunk);
                    });
    }

    void rasterize(uint32_t e, const EyeParams& eye, const FrameOptions& options, const RasterConstants& rules,
                   size_t visible, float* image, const DepthRows<float>& depth, FrameResult& result)
    {
        bool any_positive = false;
        for (const DecodeState& state : m_states)
            any_positive |= state.any_positive[e];
        if (!any_positive) {
            blendNothing(eye.width, eye.height, emptyColor(options), image, depth, options.columns);
            return blendHidden(eye.width, eye.height, options.lens[e], image, depth, options.columns);
        }
        Stopwatch watch;
        const SplatStore& store = m_stores[e];
        const bool by_group = options.reuse.policy != ReusePolicy::None;
        const size_t blocks = by_group ? m_reuse.groups().size() : (visible + kDecodeBlock - 1) / kDecodeBlock;
        const SortArgs sort{&m_model,
                            m_visible.data(),
                            store.depth_bits.data(),
                            store.origins.data(),
                            store.counts.data(),
                            uint32_t(blocks),
                            blockCapacity(),
                            by_group ? m_reuse.groups().data() : nullptr};
        const size_t count = sortCpu(sort, m_workers, m_sort);
        result.times.sort += watch.lap();
        const uint32_t grid_x = tileCount(eye.width), grid_y = tileCount(eye.height);
        result.eyes[e].pairs =
            binCpu({store.splats.data(), m_sort.keys[0].data(), count, grid_x, grid_y}, m_workers, m_bin);
        result.times.bin += watch.lap();
        BlendArgs args{m_bin.splats.data(),
                       m_bin.tile_first.data(),
                       m_bin.entries.data(),
                       grid_x,
                       grid_y,
                       eye.width,
                       eye.height,
                       rules,
                       {},
                       image,
                       depth,
                       m_sort.keys[0].data(),
                       options.columns,
                       options.view == FrameView::Cost,
                       options.lens[e]};
        std::copy_n(options.background, 3, args.background);
        result.eyes[e].blend_evaluations = blendCpu(args, m_workers);
        blendHidden(eye.width, eye.height, options.lens[e], image, depth, options.columns);
        result.times.blend += watch.lap();
    }

    [[nodiscard]] uint64_t frameBytes() const
    {
        uint64_t bytes = m_visible.bytes() + m_select.chunk_eyes.bytes() + m_select.groups.bytes() +
                         m_sort.keys[0].bytes() + m_sort.keys[1].bytes() + m_sort.histograms.bytes() +
                         m_sort.block_first.bytes() + m_bin.splats.bytes() + m_bin.tile_first.bytes() +
                         m_bin.entries.bytes() + m_bin.chunk_counts.bytes() + m_image.bytes();
        for (const SplatStore& store : m_stores)
            bytes += store.bytes();
        for (const DecodeState& state : m_states)
            bytes += state.scratch.values.bytes() + state.scratch.origins.bytes() + state.gathered.values.bytes() +
                     state.gathered.origins.bytes() + state.strip_keys.bytes() + state.strip_fixed.bytes();
        return bytes + m_reuse.bytes();
    }

    Workers m_workers;
    std::vector<DecodeState> m_states; // per worker
    ModelView m_model{};
    uint64_t m_model_bytes = 0;
    Buffer<VisibleAnchor> m_visible;
    Buffer<float> m_bias;
    SelectScratch m_select;
    SplatStore m_stores[kMaxEyes];
    CpuReuse m_reuse;
    LodLag m_lag;
    SortScratch m_sort;
    BinScratch m_bin;
    Buffer<float> m_image; // of an eye whose image nobody wants
    FrameThread m_thread;  // last: it uses all of the above
};

class ReferenceRenderer final : public Renderer {
public:
    ReferenceRenderer() : m_thread([this](auto&&... frame) { renderReference32(m_model, frame...); }) {}

    [[nodiscard]] DeviceId id() const override { return {"cpu-reference", 0}; }
    [[nodiscard]] bool onHost() const override { return true; }
    [[nodiscard]] DeviceFacts device() const override { return cpuFacts(1); }
    [[nodiscard]] Tier tierOf(Tier) const override { return Tier::Exact; } // fp32 throughout

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
        if (request.options.reuse.policy != ReusePolicy::None || request.options.lod_hysteresis > 0)
            throw Error(ErrorCode::Unsupported,
                        "backend cpu-reference: keeps nothing from frame to frame, expected "
                        "reuse policy none and a LOD hysteresis of 0; use the backend cpu or cuda");
        return m_thread.submit(request);
    }
    FrameState wait(uint64_t ticket, FrameResult& result, std::chrono::nanoseconds most) override
    {
        return m_thread.wait(ticket, result, most);
    }

private:
    ModelView m_model{};
    FrameThread m_thread; // last: it uses the model
};

} // namespace

std::unique_ptr<Renderer> makeCpuRenderer(CpuPath path, int threads)
{
    if (path == CpuPath::Reference)
        return std::make_unique<ReferenceRenderer>();
    return std::make_unique<CpuRenderer>(threads);
}

} // namespace gsc
