// SPDX-License-Identifier: Apache-2.0
// Blending of all eyes on a device. kernels/blend/cuda/blend_kernel.cuh explains it.
#pragma once

#include "kernels/bin/bin_cuda.h"
#include "kernels/decode/decode_cuda.h"

namespace gsc {

// Units of a segment: the longest lists are cut into segments behind their first units (segments.cuh).
constexpr uint32_t kSegmentUnits = 4;
constexpr uint32_t kLoneWarps = 24; // warps per multiprocessor that blend long lists

// Pixel of a segment. Segment 0 of a list holds the light left for later segments, and the colour so far. A segment
// that is blended apart holds the share of light that it lets through, and the colour it adds to a pixel that gets all
// light.
struct alignas(16) SegmentPixel {
    float color[3], transmittance;
};

// Progress of a pair of sub-tiles: the first segment that is blended apart, and how many of those are finished.
// Segments in which some pixel's light ends are then blended again; meanwhile `done` counts up, from 2^32 less their
// number, to 0.
struct SegmentState {
    uint32_t first, done;
};

struct BlendCudaArgs {
    BinGrid grid;
    uint32_t eye_count;
    bool shared_bins; // one list per bin for both eyes
    // The first starts the image, the others go on with it. The background comes in the last; in `fast` in the first.
    DepthPass pass;
    uint32_t width[kMaxEyes], height[kMaxEyes];
    LensShape lens[kMaxEyes];
    RasterConstants rules;
    float lifted_cap, lifted_stop; // cap and stop of `rules` in the units of FastRules: FastRules::lifted()
    float background[3];
    bool empty_is_black;
    const void* splats;      // PackedSplat or ExactSplat, all eyes
    const uint16_t* touches; // DecodeFrame::touches; null: splats have no codes
    uint32_t slot_capacity;  // distance from an eye's first splat to the next eye's
    const uint32_t* cells;   // ends, from bin
    const uint32_t* bin_queue;
    const uint32_t* bin_units; // result of the stage bin
    const TouchUnit* touch_units;
    uint32_t* touch; // touchWords() per unit
    // result of the stage bin; bit per sub-tile of a long list that still takes light behind its first units
    uint32_t* unfinished;
    SegmentPixel* segments;       // segmentCapacity() x pixels of a bin
    uint32_t* segment_pairs;      // segmentCapacity() x pairs of a bin: first segments, as items of SegmentQueue
    uint32_t* segment_queue;      // segmentQueueWords()
    SegmentState* segment_states; // as many as segment_pairs, by the first segment
    const SortKey* keys;          // sorted
    uint32_t pair_capacity;
    FrameCounters* counters;
    float* image[kMaxEyes];         // height x width x 3
    float* transmittance[kMaxEyes]; // height x width, as the rules have it: of pixels that are taken up again
    const SplatPlace* places;       // with the splats' depths
    float* depth[kMaxEyes];         // height x width; null where no depths are wanted
};

// Words per unit: a bit for every key and sub-tile of 32 pixels, and for every key and row.
inline size_t touchWords(const BinGrid& grid)
{
    return size_t(kTouchUnit / 32) * (kBinWidth * grid.height / 32 + grid.height);
}

// Segments of so many units at most. A segment's number is that of its first unit over kSegmentUnits. No two have the same,
// for before a list's first segment there are kFirstUnits units, which is no less.
inline size_t segmentCapacity(size_t units)
{
    static_assert(kFirstUnits >= kSegmentUnits);
    return units / kSegmentUnits + 1;
}

inline uint32_t pixelsOfBin(const BinGrid& grid)
{
    return kBinWidth * grid.height;
}

// Pairs of sub-tiles of 32 pixels.
inline uint32_t pairsOfBin(const BinGrid& grid)
{
    return pixelsOfBin(grid) / 64;
}

// Each segment may come twice, and each warp that waits has a place.
inline size_t segmentQueueWords(const BinGrid& grid, size_t units, uint32_t processors)
{
    return 2 * segmentCapacity(units) * pairsOfBin(grid) + size_t(kLoneWarps) * processors;
}

// Asynchronous. Depths, where they are wanted, are found by a kernel of their own, from the same lists.
void blendFastCuda(const BlendCudaArgs& args, uint32_t processors, CUstream_st* stream);
void blendExactCuda(const BlendCudaArgs& args, uint32_t processors, CUstream_st* stream);
// FrameView::Cost: the same, but a pixel's red is the number of splats evaluated for it.
void blendCostFastCuda(const BlendCudaArgs& args, uint32_t processors, CUstream_st* stream);
void blendCostExactCuda(const BlendCudaArgs& args, uint32_t processors, CUstream_st* stream);
// Find depths. The four above call these where depths are wanted.
void blendDepthsFastCuda(const BlendCudaArgs& args, uint32_t processors, CUstream_st* stream);
void blendDepthsExactCuda(const BlendCudaArgs& args, uint32_t processors, CUstream_st* stream);

} // namespace gsc
