// SPDX-License-Identifier: Apache-2.0
// The model as the CUDA stages read it: flat arrays over all anchors, in file order. Plain data, no CUDA header.
#pragma once

#include "format/numbers/compact.h"
#include <gsc/frame_types.h>
#include "kernels/math/eye.h"

namespace gsc {

constexpr uint32_t kAnchorBits = 30; // a visible entry is anchor | eyes << kAnchorBits
constexpr uint32_t kBinWidth = 32;   // pixels
static_assert(kColumnStep == kBinWidth);
constexpr uint32_t kMaxBins = 255;        // per axis: bin coordinates are bytes
constexpr uint32_t kNoBins = 0x0000ffffu; // bin box of a slot that holds no splat: x0 = y0 = 255, x1 = y1 = 0
// An offset of a Gaussian: x, y and z from the low bits on, 21 bits each, in steps of the anchor's largest counted from
// -2^20. Fine enough that hardly two Gaussians change their depth order, which shows more than anything else that is
// rounded in the tier `fast`.
constexpr uint32_t kOffsetBits = 21;
constexpr int32_t kOffsetSteps = (1 << (kOffsetBits - 1)) - 1; // of the largest
constexpr uint64_t kNoOffset = 0;                              // not finite: its Gaussian is dropped and counted
constexpr uint64_t kMaskedSlot = 1ull << 63;                   // its Gaussian is never drawn, and not counted
constexpr uint32_t kDepthBuckets = 32768;                      // of the depth histogram: 1024 per octave of view z
constexpr uint32_t kMaxSlabs = 1024;                           // of a pass
constexpr uint32_t kMaxPasses = 31;                            // kMaxPasses x kMaxSlabs fits 16 bits

// Shape of an anchor of a compact model (kModelCompact), 8 bytes in place of DeviceModel::shape. An extent is a float
// of 6 bits of exponent and 10 of mantissa, without a sign.
struct alignas(8) CompactShape {
    uint16_t extent[3];                 // of its Gaussians, packExtent()
    int8_t feature_power, offset_power; // exponents of the steps
};
constexpr uint32_t kExtentLeast = 87; // biased exponent of the least extent, 2^-40
// Offset of a compact model, 32 bits: x, y and z from the low bits on, 10 bits each, in steps counted from -512.
constexpr uint32_t kCompactNoOffset = 0, kCompactMasked = 1u << 31;

GSC_HD uint16_t packExtent(float extent)
{
    const float least = powerOfTwo(int(kExtentLeast) - 127);
    uint32_t word;
    extent = extent > least ? extent : least;
    memcpy(&word, &extent, sizeof word);
    word = ((word + (1u << 12)) >> 13) - (kExtentLeast << 10);
    return uint16_t(word < 0xffffu ? word : 0xffffu);
}

GSC_HD float unpackExtent(uint32_t packed)
{
    const uint32_t word = (packed + (kExtentLeast << 10)) << 13;
    float extent;
    memcpy(&extent, &word, sizeof extent);
    return extent;
}

// How an eye's image is cut: bins of kBinWidth x height pixels, each cut in depth into slabs. A cell is a slab of a bin;
// cells lie eye-major, then bin, then slab from near to far. Two eyes that look the same way may share their bins: then
// the depth order is the same for both, and there is one list of splats per bin instead of two.
struct BinGrid {
    uint32_t columns, rows, height; // height: 16 or 32 pixels
    uint32_t slab_bits;             // 2^slab_bits slabs, at least 4
    uint32_t shift[kMaxEyes] = {};  // column at which an eye's image begins; not 0 only in shared bins

    bool operator==(const BinGrid&) const = default;
    [[nodiscard]] GSC_HD uint32_t slabs() const { return 1u << slab_bits; }
    [[nodiscard]] GSC_HD uint32_t bins() const { return columns * rows; }
    [[nodiscard]] GSC_HD uint32_t cells() const { return columns * rows << slab_bits; }
};

// A frame is drawn in one or more passes from near to far, each of which decodes, sorts and blends the Gaussians of its
// depths, so that the memory a frame needs is bounded whatever it shows. The image does not depend on their number
// (kernels/README.md: but for the ends of needles).
struct DepthPass {
    const uint16_t* slab_of; // kDepthBuckets, counted over all passes
    uint32_t index, count;
};

// Where a splat lies: written by decode, read when pairs are made. In shared bins: where it lies for either eye.
struct alignas(8) SplatPlace {
    uint32_t depth_bits; // view z, whose bits order like it because it is positive
    uint32_t box;        // bins x0 | y0 << 8 | x1 << 16 | y1 << 24, inclusive, or kNoBins
};

// Code, 16 bits, of the pixels that a small splat has in an eye's picture; long lists read it in place of the splat
// (blend/cuda/touch.cuh). It holds the first of its columns of 4 pixels, modulo 16, and how many follow it, the first
// of its rows of pixels, modulo 64, and how many follow. In a bin 64 pixels off, whose list holds the splat because of
// the other eye, the code names the same sub-tiles: there the splat is evaluated for nothing, and counted.
constexpr uint32_t kTouchColumn = 4;          // pixels
constexpr uint32_t kTouchUnknown = 15u << 12; // as many rows no splat has: the splat tells
GSC_HD constexpr uint32_t touchCode(uint32_t column, uint32_t more_columns, uint32_t row, uint32_t more_rows)
{
    return (column & 15u) | more_columns << 4 | (row & 63u) << 6 | more_rows << 12;
}
// Place of a splat's code among those of all splats. slot: of the splat, counted over all lists.
GSC_HD constexpr size_t touchPlace(bool shared_bins, uint32_t eye, uint32_t slot)
{
    return shared_bins ? size_t(kMaxEyes) * slot + eye : slot;
}
constexpr float kTouchReach = 6.0f; // pixels to each side of a splat that has a code: 4 columns, 13 rows at most

// Pieces of a bin's list by length: what a warp sorts, what 2, 4, 8 and 16 warps sort, and longer.
constexpr uint32_t kWarpPiece = 512; // keys
constexpr uint32_t kPieceClasses = 6;
GSC_HD constexpr uint32_t pieceClass(uint32_t keys)
{
    uint32_t kind = 0;
    while (kind < kPieceClasses - 1 && keys > kWarpPiece << kind)
        ++kind;
    return kind;
}
constexpr uint32_t kPieceAim = 384; // keys; a piece is shorter than this plus its last cell

constexpr uint32_t kBinClasses = 33; // of bins by the position of their count's highest bit

struct Piece {
    uint32_t first, count; // of the keys
};

// Up to kRunGroups groups of one chunk, which a warp tests together; the bounds are the chunk's, so that they are there
// with one load and settle for all of its groups whether an eye may see any.
struct alignas(16) GroupRun {
    float anchor_min[3];
    float anchor_sigma_max;
    float anchor_max[3];
    float extra_level_max;
    uint32_t group_first;
    uint16_t group_count; // 1..
    uint16_t level_index;
    float gaussian_sigma_max;
    float gaussian_margin; // how far centres of Gaussians may lie outside of the anchors' box, along any axis
};
constexpr uint32_t kRunGroups = 32;

// Device pointers. n = anchors of the model.
struct DeviceModel {
    ModelParams params;
    const LevelRecord* levels;
    const GroupRecord* groups;
    const GroupRun* runs;        // run_count, all groups
    const float* lod_shift;      // per level record
    const uint32_t* level_first; // per level record: its first anchor
    const float* placement;      // n x 4: x, y, z, extra_level
    const float* size;           // n x 3: the anchor's own scale, which selection tests it with
    const float* shape;          // n x 6: world units per step of `offset`, scale of its Gaussians
    const float* rotation;       // n x 4 or null: params.constant_rotation
    const uint16_t* feature;     // n x F halves
    const uint64_t* offset;      // n x K
    const uint32_t* source;      // n: source index
    // Arrays of a compact model, in place of shape, feature and offset, which are null then. Null in other models.
    const CompactShape* compact_shape; // n
    const uint32_t* compact_feature;   // n x F / 4: four of 8 bits, from the low ones on, each 128 more than its steps
    const uint32_t* compact_offset;    // n x K
    uint32_t run_count;
    uint32_t anchor_count;
};

// Bits of FrameCounters::overflow: which buffer was too small.
constexpr uint32_t kVisibleOverflow = 1u, kSlotOverflow = 2u, kPairOverflow = 4u;

// Counters of a pass, cleared before it. Where the eyes share their bins, counters per eye count under the first.
struct PassCounters {
    unsigned long long
        pairs[kMaxEyes];      // (bin, splat); more than 2^32 of them overflow the cells, so they are counted apart
    uint32_t slots[kMaxEyes]; // splat slots reserved, with gaps
    uint32_t gaps[kMaxEyes];  // slots of those that stayed unused
    uint32_t anchors_listed;  // of a pass of several (select_cuda.h)
    uint32_t pieces[kPieceClasses], next_piece[kPieceClasses];
    uint32_t bin_classes[kBinClasses], queued[kBinClasses]; // fullest first
    uint32_t wide;                                          // splats of many bins, of which kWideSplats are listed
    uint32_t bins;                                          // that are queued: those of the columns that are drawn
    uint32_t long_bins;                                     // of those, the first: with long lists (bin_cuda.h)
    uint32_t longest_bins;  // of those, the first: with lists of kFirstUnits units or more
    uint32_t touch_units;   // of long lists, for all their readers
    uint32_t next_anchors;  // work queue of decode
    uint32_t segment_pairs; // BlendCudaArgs::segment_pairs
    uint32_t segments_pushed, segments_taken, segments_finished; // SegmentQueue
    uint32_t next_tile[3], next_bin[2]; // work queues of the blend: LongPart; of colours, of depths
};

enum class Stage : uint32_t { Select, Decode, Bin, Sort, Blend, None };
constexpr uint32_t kStages = 6;

// FrameOptions::detail (kernels/coarse/coarse_cuda.h), 0 without it.
struct CoarseCounters {
    uint32_t near, drawn, wants; // lengths of the lists
    uint32_t granted_before;     // buckets of urgency below this are made
    uint32_t evicted_from;       // copies that were not drawn for as many frames give their pages back; 0: none do
    uint32_t groups_near, groups_kept, groups_stale, groups_made;
    uint32_t anchors_made, anchors_kept, anchors_stale;
};

// One for all frames, which follow each other; a copy at a frame's end is the host's, for counts and to grow buffers.
struct FrameCounters {
    PassCounters pass;
    uint32_t groups_visible;           // to be looked at
    uint32_t anchors_listed;           // entries of the visible list
    uint32_t groups_tested[kMaxEyes];  // of chunks that the eye may see
    uint32_t anchors_tested[kMaxEyes]; // of groups that are looked at
    uint32_t anchors_visible[kMaxEyes];
    uint32_t any_positive[kMaxEyes];    // an opacity above zero existed (trap 25), or may exist outside of the columns
    uint32_t splats[kMaxEyes];          // on screen
    uint32_t gaussians[kMaxEyes];       // opacity >= 1/255
    uint32_t dropped[kMaxEyes];         // not finite
    uint32_t most_slots;                // of a pass and a list
    uint32_t all_slots;                 // of all passes, without gaps, of the longer list
    unsigned long long most_pairs;      // of a pass
    unsigned long long pairs[kMaxEyes]; // under the first in shared bins
    unsigned long long evaluations[kMaxEyes];
    CoarseCounters coarse;
    uint32_t overflow;
    ColumnRange columns; // FrameOptions: select writes them here, since a captured graph keeps its arguments
    unsigned long long
        stage_ns[kStages]; // what stages took that have ended (stage_clock_cuda.h); not cleared with the rest
};

// True if a buffer overflowed: the frame is drawn again, so its later stages can skip.
GSC_HD bool willRepeat(const FrameCounters& counters)
{
    return counters.overflow != 0;
}

} // namespace gsc
