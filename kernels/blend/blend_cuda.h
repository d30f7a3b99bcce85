// SPDX-License-Identifier: Apache-2.0
// Blends the pictures of all eyes on a device; kernels/blend/cuda/blend_kernel.cuh explains how.
#pragma once

#include "kernels/bin/bin_cuda.h"
#include "kernels/decode/decode_cuda.h"

namespace gsc {

// Number of units in a segment: the longest lists are cut into segments behind their first units (segments.cuh).
constexpr uint32_t kSegmentUnits = 4;
constexpr uint32_t kLoneWarps = 24; // warps that blend long lists, per multiprocessor

// State of a pixel at the end of a segment. Segment 0 of a list holds the light left for later segments, and the colour
// so far. A segment that is blended apart holds the share of light that it lets through, and the colour that it adds to
// a pixel which gets all light.
struct alignas(16) SegmentPixel {
    float color[3], transmittance;
};

// Progress of a pair of sub-tiles: the first segment that is blended apart, and how many segments from there on are
// finished. Segments in which the light of some pixel ends are then blended again; meanwhile `done` counts up to 0 from
// 2^32 less their number.
struct SegmentState {
    uint32_t first, done;
};

struct BlendCudaArgs {
    BinGrid grid;
    uint32_t eye_count;
    bool shared_bins; // true: one list per bin for both eyes; false: one for each eye
    // Pass that is drawn. The first one starts the image, later ones continue it. The background is added in the last
    // pass, with `fast` in the first.
    DepthPass pass;
    uint32_t width[kMaxEyes], height[kMaxEyes];
    LensShape lens[kMaxEyes];
    RasterConstants rules;
    float lifted_cap, lifted_stop; // cap and stop of `rules`, in the units of FastRules (FastRules::lifted())
    float background[3];
    bool empty_is_black;
    const void* splats;      // PackedSplat or ExactSplat, of all eyes
    const uint16_t* touches; // DecodeFrame::touches; null if the splats have no such codes
    uint32_t slot_capacity;  // number of splats from an eye's first to the next eye's first
    const uint32_t* cells;   // end of each cell in `keys`, from stage bin
    const uint32_t* bin_queue;
    const uint32_t* bin_units; // first unit of each long list, from stage bin
    const TouchUnit* touch_units;
    uint32_t* touch; // touchWords() words for each unit
    // One word per list and reader, from stage bin on: a bit for each sub-tile of a long list that still takes light
    // behind the list's first units.
    uint32_t* unfinished;
    SegmentPixel* segments;  // segmentCapacity() x pixels of a bin elements
    uint32_t* segment_pairs; // segmentCapacity() x sub-tile pairs of a bin: first segments, as items of SegmentQueue
    uint32_t* segment_queue; // segmentQueueWords() words
    SegmentState* segment_states; // as many elements as segment_pairs, found by the number of the list's first segment
    const SortKey* keys;          // keys of the splats, sorted in each piece
    uint32_t pair_capacity;
    FrameCounters* counters;
    float* image[kMaxEyes]; // height x width x 3 values of each eye
    // height x width values: light left in pixels that a later launch continues, in the units of the rules
    float* transmittance[kMaxEyes];
    const SplatPlace* places; // hold the depths of the splats
    float* depth[kMaxEyes];   // height x width values; null if no depths are wanted
};

// Words of `touch` for each unit: a bit for every key and sub-tile of 32 pixels, and for every key and row.
inline size_t touchWords(const BinGrid& grid)
{
    return size_t(kTouchUnit / 32) * (kBinWidth * grid.height / 32 + grid.height);
}

// Largest number of segments that so many units can have. A segment's number is that of its first unit divided by
// kSegmentUnits. No two segments have equal numbers, since each list has kFirstUnits units before its first segment,
// and kFirstUnits >= kSegmentUnits.
inline size_t segmentCapacity(size_t units)
{
    static_assert(kFirstUnits >= kSegmentUnits);
    return units / kSegmentUnits + 1;
}

inline uint32_t pixelsOfBin(const BinGrid& grid)
{
    return kBinWidth * grid.height;
}

// Number of pairs of sub-tiles (32 pixels each) in a bin.
inline uint32_t pairsOfBin(const BinGrid& grid)
{
    return pixelsOfBin(grid) / 64;
}

// Words of segment_queue: each segment may be queued twice, and each waiting warp has a place.
inline size_t segmentQueueWords(const BinGrid& grid, size_t units, uint32_t processors)
{
    return 2 * segmentCapacity(units) * pairsOfBin(grid) + size_t(kLoneWarps) * processors;
}

// Blend the pictures of a tier. Asynchronous. If depths are wanted, a separate kernel finds them from the same lists.
void blendFastCuda(const BlendCudaArgs& args, uint32_t processors, CUstream_st* stream);
void blendExactCuda(const BlendCudaArgs& args, uint32_t processors, CUstream_st* stream);
// Blend FrameView::Cost: as the pictures, but red is the number of splats evaluated for the pixel.
void blendCostFastCuda(const BlendCudaArgs& args, uint32_t processors, CUstream_st* stream);
void blendCostExactCuda(const BlendCudaArgs& args, uint32_t processors, CUstream_st* stream);
// Find the depths of pixels. The four functions above call these where depths are wanted.
void blendDepthsFastCuda(const BlendCudaArgs& args, uint32_t processors, CUstream_st* stream);
void blendDepthsExactCuda(const BlendCudaArgs& args, uint32_t processors, CUstream_st* stream);

} // namespace gsc
