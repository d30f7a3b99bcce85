// SPDX-License-Identifier: Apache-2.0
#include "runtime/cpu/frame_cpu.h"

#include "kernels/threads/stopwatch.h"
#include "runtime/cpu/frame/paint_cpu.h"
#include "runtime/cpu/stereo_cpu.h"
#include "runtime/backend/frame_checks.h"

#include <algorithm>

namespace gsc {

namespace {

void paintBlock(const ModelView& model, SplatStore& store, size_t block, size_t first, const VisibleAnchor* visible,
                FrameView view)
{
    // without reuse and detail every Gaussian is made for this frame: age 0, source near
    const FalseColour fresh = view == FrameView::Age ? ageColour(0) : detailColour(GroupSource::Near);
    paintSplats(
        store.splats.data() + first, store.origins.data() + first, store.counts[block], model.params->n_offsets,
        [&](uint32_t entry) { return view == FrameView::Level ? chunkColour(model, visible[entry].chunk) : fresh; });
}

SelectArgs selectArgs(const ModelView& model, const EyeParams* eyes, uint32_t eye_count, const FrameOptions& options)
{
    return {
        &model,           eyes,           eye_count, rasterConstants(*model.params, options.near_z), options.lod_bias,
        options.lod_fade, options.columns};
}

} // namespace

void CpuFrame::load(const ModelView& from)
{
    model = {}; // the model stays empty unless everything below succeeds
    for (DecodeState& state : states)
        reserveDecode(from, state.scratch);
    model = from;
    capacity = kDecodeBlock * model.params->n_offsets;
}

void CpuFrame::beginCounts(const SelectCounts& counts, uint32_t eye_count, FrameResult& result)
{
    for (uint32_t e = 0; e < eye_count; ++e) {
        EyeCounts& eye = result.eyes[e];
        eye.groups_tested = counts.groups_tested[e];
        eye.anchors_tested = counts.anchors_tested[e];
        eye.anchors_visible = counts.anchors_visible[e];
    }
    for (DecodeState& state : states)
        state.clearCounts();
}

void CpuFrame::select(const EyeParams* eyes, uint32_t eye_count, const FrameOptions& options, FrameResult& result)
{
    Stopwatch watch;
    SelectCounts counts{};
    visible_count = selectCpu(selectArgs(model, eyes, eye_count, options), workers, selected, visible, counts);
    beginCounts(counts, eye_count, result);
    result.times.select = watch.lap();
}

size_t CpuFrame::selectGroups(const EyeParams* eyes, uint32_t eye_count, const FrameOptions& options,
                              FrameResult& result)
{
    Stopwatch watch;
    SelectCounts counts{};
    const size_t seen = selectGroupsCpu(selectArgs(model, eyes, eye_count, options), workers, selected, counts);
    beginCounts(counts, eye_count, result);
    result.times.select = watch.lap();
    return seen;
}

void CpuFrame::selectAnchors(const EyeParams* eyes, uint32_t eye_count, const FrameOptions& options,
                             const std::vector<SeenGroup>& groups, FrameResult& result)
{
    Stopwatch watch;
    SelectCounts counts{};
    visible_count = selectAnchorsCpu(selectArgs(model, eyes, eye_count, options), groups.data(), groups.size(), workers,
                                     selected, visible, counts);
    for (uint32_t e = 0; e < eye_count; ++e) {
        result.eyes[e].anchors_tested = counts.anchors_tested[e];
        result.eyes[e].anchors_visible = counts.anchors_visible[e];
    }
    result.times.select += watch.lap();
}

void CpuFrame::checkSlots(size_t anchors) const
{
    if (anchors * model.params->n_offsets > UINT32_MAX)
        throw Error(ErrorCode::OutOfMemory, "frame",
                    formatString("%zu visible anchors of %u Gaussians each", anchors, model.params->n_offsets),
                    "fewer than 2^32 Gaussians", "raise the LOD or look at less of the model");
}

void CpuFrame::decode(const EyeParams* eyes, uint32_t eye_count, const FrameOptions& options, FrameResult& result,
                      size_t more_blocks)
{
    Stopwatch watch;
    const size_t all_blocks = blocks() + more_blocks;
    checkSlots(all_blocks * kDecodeBlock);
    for (uint32_t e = 0; e < eye_count; ++e) {
        stores[e].reserve(all_blocks, all_blocks * capacity);
        result.eyes[e].anchors_decoded = result.eyes[e].anchors_visible;
    }
    EyeParams middle{};
    const bool merged = decodesMerged(options, eye_count);
    if (merged) {
        mergedCenter(eyes, middle.center);
        result.eyes[0].anchors_decoded = visible_count;
        result.eyes[1].anchors_decoded = 0;
        for (DecodeState& state : states)
            reserveDecode(model, state.gathered);
    }
    const RasterConstants rules = rasterConstants(*model.params, options.near_z);
    const DecodeArgs args = prepareDecode(model, merged ? &middle : eyes, merged ? 1 : eye_count, visible.data(),
                                          visible_count, options.appearance, bias);
    workers.run(blocks(), 1, [&](size_t begin, size_t end, int worker) {
        for (size_t block = begin; block < end; ++block)
            decodeBlock(args, eyes, eye_count, rules, options, block, states[size_t(worker)]);
    });
    addShares(states, watch.lap(), result.times);
}

// with more eyes than `args` decodes for, both eyes draw the same decoded Gaussians
void CpuFrame::decodeBlock(const DecodeArgs& args, const EyeParams* eyes, uint32_t eye_count,
                           const RasterConstants& rules, const FrameOptions& options, size_t block, DecodeState& state)
{
    Stopwatch watch;
    const size_t first = block * kDecodeBlock;
    const auto count = uint32_t(std::min<size_t>(kDecodeBlock, visible_count - first));
    const bool merged = args.eye_count < eye_count;
    if (merged)
        decodeForBothEyes(args, first, count, state.scratch);
    else
        decodeBlockCpu(args, first, count, state.scratch);
    state.decode_ms += watch.lap();
    for (uint32_t e = 0; e < eye_count; ++e) {
        const GaussianBlock& gaussians = merged ? gaussiansOfEye(state.scratch.blocks[0], args.visible + first, count,
                                                                 e, model.params->n_offsets, state.gathered.blocks[e])
                                                : state.scratch.blocks[e];
        projectInto(stores[e], block, block * capacity, {eyes + e, rules, nullptr, options.columns}, gaussians, e,
                    state);
        if (paintsGaussians(options.view))
            paintBlock(model, stores[e], block, block * capacity, args.visible + first, options.view);
    }
    state.project_ms += watch.lap();
}

size_t CpuFrame::list(uint32_t e, const EyeParams& eye, size_t blocks, const uint32_t* groups, FrameResult& result,
                      size_t ordered_blocks)
{
    Stopwatch watch;
    const SplatStore& store = stores[e];
    const size_t count = sortCpu({model.params != nullptr ? &model : nullptr, visible.data(), store.depth_bits.data(),
                                  store.origins.data(), store.counts.data(), uint32_t(blocks), capacity, groups,
                                  uint32_t(ordered_blocks)},
                                 workers, sort);
    result.times.sort += watch.lap();
    result.eyes[e].pairs = binCpu(
        {store.splats.data(), sort.keys[0].data(), count, tileCount(eye.width), tileCount(eye.height)}, workers, bin);
    result.times.bin += watch.lap();
    return count;
}

BlendArgs CpuFrame::listed(const EyeParams& eye, const RasterConstants& rules) const
{
    return {bin.splats.data(),
            bin.tile_first.data(),
            bin.entries.data(),
            tileCount(eye.width),
            tileCount(eye.height),
            eye.width,
            eye.height,
            rules};
}

uint64_t CpuFrame::bytes() const
{
    uint64_t bytes = visible.bytes() + selected.chunk_eyes.bytes() + selected.seen.bytes() + selected.groups.bytes() +
                     sort.keys[0].bytes() + sort.keys[1].bytes() + sort.histograms.bytes() + sort.block_first.bytes() +
                     bin.splats.bytes() + bin.tile_first.bytes() + bin.entries.bytes() + bin.chunk_counts.bytes();
    for (const SplatStore& store : stores)
        bytes += store.bytes();
    for (const DecodeState& state : states)
        bytes += state.scratch.values.bytes() + state.scratch.origins.bytes() + state.gathered.values.bytes() +
                 state.gathered.origins.bytes() + state.strip_keys.bytes() + state.strip_fixed.bytes();
    return bytes;
}

} // namespace gsc
