// SPDX-License-Identifier: Apache-2.0
#include "runtime/cuda/frame/frame_stages.h"

#include "kernels/decode/decode_body.h"
#include "kernels/decode/exact/decode_exact_cuda.h"
#include "kernels/math/lod.h"
#include "kernels/math/projection.h"
#include "kernels/present/false_colour.h"
#include "kernels/select/select_cuda.h"
#include "kernels/sort/sort_cuda.h"
#include "runtime/backend/frame_checks.h"
#include "runtime/view/stereo.h"

#include <algorithm>
#include <cmath>

namespace gsc {

namespace {

DepthPass passOf(const FrameJob& job, uint32_t index)
{
    return {job.buffers.slab_of, index, job.shape.passes};
}

// Sets the arguments that the decode kernels of both tiers take.
void setDecodeFrame(DecodeFrame& frame, const FrameJob& job, uint32_t pass)
{
    setNow(frame, job.now);
    frame.model = job.scene.model();
    frame.eye_count = job.shape.eye_count;
    frame.merged = job.shape.merged;
    frame.shared_bins = job.shape.shared_bins;
    frame.thins = job.shape.thins;
    frame.rules = job.shape.rules;
    frame.grid = job.shape.grid;
    frame.pass = passOf(job, pass);
    const bool whole = job.shape.passes == 1;
    frame.visible = whole ? job.buffers.visible : job.buffers.listed;
    frame.fraction = whole ? job.buffers.fraction : job.buffers.listed_fraction;
    frame.visible_count = whole ? &job.buffers.counters->anchors_listed : &job.buffers.counters->pass.anchors_listed;
    frame.visible_capacity = job.capacity.visible;
    frame.places = job.buffers.places;
    frame.touches = job.buffers.touches;
    frame.cells = job.buffers.cells;
    frame.slot_capacity = job.capacity.slots;
    frame.counters = job.buffers.counters;
    frame.bank = job.scene.bank();
    frame.takes_distance = job.scene.takes(kMlpTakesDistance);
    frame.takes_level = job.scene.takes(kMlpTakesLevel);
}

DecodeExactArgs decodeExactArgs(const FrameJob& job, uint32_t pass)
{
    DecodeExactArgs args{};
    setDecodeFrame(args, job, pass);
    args.view = job.scene.exactView();
    args.appearance = job.shape.appearance;
    args.weights = job.scene.exactWeights();
    args.scratch = job.buffers.scratch;
    args.scratch_values = uint32_t(decodeScratch(job.scene.model().params));
    args.splats = reinterpret_cast<ExactSplat*>(job.buffers.splats);
    return args;
}

} // namespace

void FrameShape::shareBins(EyeParams* eyes)
{
    shared_bins = eye_count == 2 && !exact && sameDepths(eyes[0], eyes[1]);
    if (!shared_bins)
        return;
    const auto axis = [&](uint32_t e) { return axisPixel(eyes[e].width, eyes[e].focal_x, eyes[e].tan_mid_x); };
    // number of columns by which the same point's bins lie further right in the second eye
    const float columns = std::round((axis(0) - axis(1)) / float(kBinWidth));
    // with a larger shift, two separate lists need fewer bins
    const auto most = float(std::min(kMaxBins - grid.columns, grid.columns));
    if (!(std::abs(columns) <= most)) {
        shared_bins = false;
        return;
    }
    grid.shift[columns < 0 ? 0 : 1] = uint32_t(std::abs(columns));
    grid.columns += uint32_t(std::abs(columns));
    // both eyes get the same depths, so that a Gaussian is in the same depth cell and pass for both
    std::copy_n(eyes[0].world_to_view + 8, 4, eyes[1].world_to_view + 8);
}

FrameShape frameShape(const ModelParams& params, Tier tier, uint32_t eye_count, const FrameOptions& options,
                      EyeParams* eyes)
{
    checkReuse("cuda", options.reuse.policy);
    if (options.reuse.policy != ReusePolicy::None && tier == Tier::Exact)
        throw Error(ErrorCode::Unsupported, "cuda", "reuse in the tier exact", "reuse policy none there",
                    "use the tier fast, if the model has it, or the backend cpu");
    if (options.detail > 0 && options.tier == Tier::Exact)
        throw Error(ErrorCode::Unsupported, "cuda",
                    formatString("detail of %g pixels in the tier exact", double(options.detail)), "0 there",
                    "use the tier fast or the backend cpu");
    FrameShape shape{};
    uint32_t width = 0, height = 0;
    for (uint32_t e = 0; e < eye_count; ++e) {
        const EyeParams& eye = eyes[e];
        width = std::max(width, eye.width);
        height = std::max(height, eye.height);
        shape.width[e] = eye.width;
        shape.height[e] = eye.height;
    }
    // bins 16 pixels high have shorter lists; an image too high for them gets bins of 32
    shape.grid.height = height <= kMaxBins * 16 ? 16 : 32;
    if (width > kMaxBins * kBinWidth || height > kMaxBins * shape.grid.height)
        throw Error(ErrorCode::Unsupported, "cuda", formatString("image of %u x %u pixels", width, height),
                    formatString("at most %u x %u", kMaxBins * kBinWidth, kMaxBins * 32),
                    "draw smaller images, or draw on the CPU")
            .with({Setting::ImageSize, Setting::CpuBackend});
    shape.grid.columns = (width + kBinWidth - 1) / kBinWidth;
    shape.grid.rows = (height + shape.grid.height - 1) / shape.grid.height;
    shape.eye_count = eye_count;
    shape.passes = 1;
    shape.rules = rasterConstants(params, options.near_z);
    shape.exact = tier == Tier::Exact;
    shape.fades = levelsFade(params, options.lod_fade);
    shape.merged = decodesMerged(options, eye_count);
    shape.thins = !shape.exact && options.foveation.smallest > 0;
    shape.uses_reuse = options.reuse.policy != ReusePolicy::None;
    // tier exact draws every Gaussian itself, also if it stands in for tier fast
    shape.coarse = options.detail > 0 && tier != Tier::Exact;
    std::copy_n(options.background, 3, shape.background);
    shape.appearance = options.appearance;
    shape.empty_is_black = options.empty_is_black;
    shape.view = options.view;
    std::copy_n(options.lens, eye_count, shape.lens);
    shape.shareBins(eyes);
    return shape;
}

void setFoveation(const Foveation& foveation, FrameNow& now)
{
    now.finest = foveation.smallest * foveation.smallest;
    for (size_t e = 0; e < kMaxEyes; ++e) {
        const float x = foveation.gaze[e][0], y = foveation.gaze[e][1], length = std::sqrt(x * x + y * y + 1);
        now.gaze[e][0] = x / length;
        now.gaze[e][1] = y / length;
        now.gaze[e][2] = 1 / length;
    }
}

FrameBuffers layOutFrame(ArenaLayout& layout, const DeviceScene& scene, const FrameShape& shape,
                         const FrameCapacity& capacity, const CudaLimits& limits)
{
    const ModelParams& params = scene.model().params;
    FrameBuffers b{};
    // one array, so that one memset clears it
    auto* cleared = layout.take<unsigned char>(kDepthBuckets * sizeof(uint32_t) + sizeof(FrameCounters));
    if (cleared != nullptr) {
        b.histogram = reinterpret_cast<uint32_t*>(cleared);
        b.counters = reinterpret_cast<FrameCounters*>(b.histogram + kDepthBuckets);
    }
    b.visible_groups = layout.take<uint32_t>(params.group_count);
    b.visible = layout.take<uint32_t>(capacity.visible);
    if (shape.fades && shape.uses_reuse) // strips are padded, so one value for each anchor of every group
        b.fraction = layout.take<float>(size_t(kMaxEyes) * params.group_count * kGroupSize);
    else if (shape.fades)
        b.fraction = layout.take<float>(size_t(kMaxEyes) * capacity.visible);
    if (shape.passes > 1) {
        b.listed = layout.take<uint32_t>(capacity.visible);
        if (shape.fades)
            b.listed_fraction = layout.take<float>(size_t(kMaxEyes) * capacity.visible);
    }
    const size_t scratch = shape.exact && scene.exactWeights() == nullptr
                               ? exactScratchValues(uint32_t(decodeScratch(params)), limits.processors)
                               : size_t(0);
    if (scratch != 0)
        b.scratch = layout.take<float>(scratch);
    b.slab_of = layout.take<uint16_t>(kDepthBuckets);
    b.cells = layout.take<uint32_t>(shape.cells());
    b.scan_bytes = binScratchBytes(shape.cells());
    b.scan_scratch = layout.take<unsigned char>(b.scan_bytes);
    b.bin_class = layout.take<uint32_t>(shape.bins());
    b.bin_queue = layout.take<uint32_t>(shape.bins());
    b.pieces = layout.take<Piece>(size_t(kPieceClasses) * pieceCapacity(shape.bins(), capacity.pairs));
    b.bin_units = layout.take<uint32_t>(shape.bins());
    const size_t units = touchCapacity(shape.eye_count / shape.lists(), shape.bins(), capacity.pairs);
    b.touch_units = layout.take<TouchUnit>(units);
    b.touch = layout.take<uint32_t>(units * touchWords(shape.grid));
    b.unfinished = layout.take<uint32_t>(size_t(shape.eye_count) * shape.grid.bins());
    if (!shape.exact) {
        b.segments = layout.take<SegmentPixel>(segmentCapacity(units) * pixelsOfBin(shape.grid));
        b.segment_pairs = layout.take<uint32_t>(segmentCapacity(units) * pairsOfBin(shape.grid));
        b.segment_queue = layout.take<uint32_t>(segmentQueueWords(shape.grid, units, limits.processors));
        b.segment_states = layout.take<SegmentState>(segmentCapacity(units) * pairsOfBin(shape.grid));
    }
    const size_t slots = size_t(shape.eye_count) * capacity.slots;
    b.splats = layout.take<unsigned char>(slots * shape.splatBytes());
    b.places = layout.take<SplatPlace>(size_t(shape.lists()) * capacity.slots);
    if (!shape.exact)
        b.touches = layout.take<uint16_t>(slots);
    b.keys = layout.take<SortKey>(capacity.pairs);
    b.wide = layout.take<uint32_t>(kWideSplats);
    for (uint32_t e = 0; e < shape.eye_count; ++e) {
        b.image[e] = layout.take<float>(shape.pixels(e) * 3);
        b.transmittance[e] = layout.take<float>(shape.pixels(e));
        if (shape.depths)
            b.depth[e] = layout.take<float>(shape.pixels(e));
    }
    return b;
}

SelectCudaArgs selectArgs(const FrameJob& job)
{
    SelectCudaArgs args{};
    setNow(args, job.now);
    args.model = job.scene.model();
    args.eye_count = job.shape.eye_count;
    args.rules = job.shape.rules;
    args.visible_groups = job.buffers.visible_groups;
    args.listed_groups = args.visible_groups;
    args.group_count = &job.buffers.counters->groups_visible;
    args.visible = job.buffers.visible;
    args.fraction = job.buffers.fraction;
    args.capacity = job.capacity.visible;
    args.histogram = job.buffers.histogram;
    args.counters = job.buffers.counters;
    return args;
}

void listPass(FrameCapture& capture, const FrameJob& job, uint32_t pass)
{
    if (job.shape.passes == 1)
        return;
    PassListArgs args{};
    setNow(args, job.now);
    args.model = job.scene.model();
    args.eye_count = job.shape.eye_count;
    args.grid = job.shape.grid;
    args.pass = passOf(job, pass);
    args.visible = job.buffers.visible;
    args.fraction = job.buffers.fraction;
    args.capacity = job.capacity.visible;
    args.listed = job.buffers.listed;
    args.listed_fraction = job.buffers.listed_fraction;
    args.counters = job.buffers.counters;
    capture.add(args, listPassCuda);
}

DecodeCudaArgs decodeArgs(const FrameJob& job, uint32_t pass)
{
    DecodeCudaArgs args{};
    setDecodeFrame(args, job, pass);
    args.fragments = job.scene.fragments();
    args.biases = job.scene.biases();
    args.splats = reinterpret_cast<PackedSplat*>(job.buffers.splats);
    args.inverse_offsets = inverseOffsets(job.scene.model().params.n_offsets);
    return args;
}

void cutDepths(FrameCapture& capture, const FrameJob& job)
{
    slabCuda({job.buffers.histogram, job.buffers.slab_of, job.shape.passes << job.shape.grid.slab_bits},
             capture.stream().handle);
}

void decodeFrame(FrameCapture& capture, const FrameJob& job, uint32_t pass)
{
    if (!job.shape.exact)
        return capture.add(decodeArgs(job, pass), [&](const DecodeCudaArgs& args, CUstream_st* stream) {
            decodeFastCuda(args, capture.processors(), job.limits.shared_bytes, stream);
        });
    capture.add(decodeExactArgs(job, pass), [&](const DecodeExactArgs& args, CUstream_st* stream) {
        decodeExactCuda(args, capture.processors(), job.limits.shared_bytes, stream);
    });
}

PaintCudaArgs paintArgs(const FrameJob& job)
{
    const DeviceModel& model = job.scene.model();
    PaintCudaArgs args{};
    args.splats = job.buffers.splats;
    args.exact = job.shape.exact;
    args.shared_bins = job.shape.shared_bins;
    args.eye_count = job.shape.eye_count;
    args.slot_capacity = job.capacity.slots;
    args.places = job.buffers.places;
    args.counters = job.buffers.counters;
    args.n_offsets = model.params.n_offsets;
    args.origins = job.scene.origins();
    args.groups = model.groups;
    args.levels = model.levels;
    return args;
}

void paintFrame(FrameCapture& capture, const FrameJob& job)
{
    const bool ages = job.shape.view == FrameView::Age, groups = job.shape.view == FrameView::Detail;
    if (!paintsGaussians(job.shape.view) || (ages && job.shape.uses_reuse) || ((ages || groups) && job.shape.coarse))
        return;
    PaintCudaArgs args = paintArgs(job);
    if (ages || groups) { // no Gaussian is kept from frame to frame, so all get one colour
        args.origins = nullptr;
        args.colour = ages ? ageColour(0) : detailColour(GroupSource::Near);
    }
    paintSplatsCuda(args, capture.processors(), capture.stream().handle);
}

void binFrame(FrameCapture& capture, const FrameJob& job, uint32_t pass)
{
    BinCudaArgs args{};
    args.grid = job.shape.grid;
    args.lists = job.shape.lists();
    args.readers = job.shape.eye_count / args.lists;
    std::ranges::copy(job.shape.lens, args.lens);
    args.places = job.buffers.places;
    args.slot_capacity = job.capacity.slots;
    args.pass = passOf(job, pass);
    args.cells = job.buffers.cells;
    args.keys = job.buffers.keys;
    args.pair_capacity = job.capacity.pairs;
    args.wide = job.buffers.wide;
    args.bin_class = job.buffers.bin_class;
    args.bin_queue = job.buffers.bin_queue;
    args.bin_units = job.buffers.bin_units;
    args.touch_units = job.buffers.touch_units;
    args.unfinished = job.buffers.unfinished;
    args.pieces = job.buffers.pieces;
    args.piece_capacity = pieceCapacity(job.shape.bins(), job.capacity.pairs);
    args.scratch = job.buffers.scan_scratch;
    args.scratch_bytes = job.buffers.scan_bytes;
    args.counters = job.buffers.counters;
    binCuda(args, capture.processors(), capture.stream().handle);
}

void sortFrame(FrameCapture& capture, const FrameJob& job)
{
    const size_t order = job.shape.exact ? offsetof(ExactSplat, order) : offsetof(PackedSplat, order);
    sortCuda({job.buffers.keys, reinterpret_cast<const uint32_t*>(job.buffers.splats + order), job.shape.exact,
              job.buffers.pieces, pieceCapacity(job.shape.bins(), job.capacity.pairs), job.buffers.counters},
             capture.processors(), capture.stream().handle);
}

void blendFrame(FrameCapture& capture, const FrameJob& job, uint32_t pass)
{
    BlendCudaArgs args{};
    args.grid = job.shape.grid;
    args.eye_count = job.shape.eye_count;
    args.shared_bins = job.shape.shared_bins;
    args.pass = passOf(job, pass);
    for (uint32_t e = 0; e < job.shape.eye_count; ++e) {
        args.width[e] = job.shape.width[e];
        args.height[e] = job.shape.height[e];
        args.image[e] = job.buffers.image[e];
        args.transmittance[e] = job.buffers.transmittance[e];
        args.depth[e] = job.buffers.depth[e];
    }
    std::ranges::copy(job.shape.lens, args.lens);
    args.rules = job.shape.rules;
    std::copy_n(job.shape.background, 3, args.background);
    args.empty_is_black = job.shape.empty_is_black;
    args.splats = job.buffers.splats;
    args.touches = job.buffers.touches;
    args.slot_capacity = job.capacity.slots;
    args.cells = job.buffers.cells;
    args.bin_queue = job.buffers.bin_queue;
    args.bin_units = job.buffers.bin_units;
    args.touch_units = job.buffers.touch_units;
    args.touch = job.buffers.touch;
    args.unfinished = job.buffers.unfinished;
    args.segments = job.buffers.segments;
    args.segment_pairs = job.buffers.segment_pairs;
    args.segment_queue = job.buffers.segment_queue;
    args.segment_states = job.buffers.segment_states;
    args.places = job.buffers.places;
    args.keys = job.buffers.keys;
    args.pair_capacity = job.capacity.pairs;
    args.counters = job.buffers.counters;
    const bool cost = job.shape.view == FrameView::Cost;
    const auto blend = cost ? (job.shape.exact ? blendCostExactCuda : blendCostFastCuda)
                            : (job.shape.exact ? blendExactCuda : blendFastCuda);
    blend(args, capture.processors(), capture.stream().handle);
    if (!cost || pass + 1 != job.shape.passes)
        return;
    CostCudaArgs counts{};
    for (uint32_t e = 0; e < job.shape.eye_count; ++e) {
        counts.image[e] = job.buffers.image[e];
        counts.pixels[e] = uint32_t(job.shape.pixels(e));
    }
    counts.eye_count = job.shape.eye_count;
    counts.counters = job.buffers.counters;
    paintCostCuda(counts, capture.processors(), capture.stream().handle);
}

} // namespace gsc
