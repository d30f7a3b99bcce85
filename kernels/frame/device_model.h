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
// Offset of a Gaussian: x, y and z from the low bits on, 21 bits each, counted from -2^20 in steps of the anchor's largest
// offset. So fine that the depth order of hardly any two Gaussians changes; a changed order would be the most visible
// rounding of the tier `fast`.
constexpr uint32_t kOffsetBits = 21;
constexpr int32_t kOffsetSteps = (1 << (kOffsetBits - 1)) - 1; // steps of the largest offset
constexpr uint64_t kNoOffset = 0;                              // not finite: its Gaussian is dropped and counted
constexpr uint64_t kMaskedSlot = 1ull << 63;                   // set: the Gaussian is never drawn nor counted
constexpr uint32_t kDepthBuckets = 32768; // buckets of the depth histogram: 1024 per octave of view z
constexpr uint32_t kMaxSlabs = 1024;      // most slabs of a pass
constexpr uint32_t kMaxPasses = 31;       // kMaxPasses x kMaxSlabs fits 16 bits

// Shape of an anchor of a compact model (kModelCompact), 8 bytes in place of DeviceModel::shape. An extent is a float
// of 6 bits of exponent and 10 of mantissa, without a sign.
struct alignas(8) CompactShape {
    uint16_t extent[3];                 // extent of its Gaussians, packExtent()
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

// Cut of an eye's image into bins of kBinWidth x height pixels, each cut in depth into slabs. A cell is a slab of a bin;
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

// Place of a splat on the screen: written by decode, read when pairs are made. With shared bins it covers both eyes.
struct alignas(8) SplatPlace {
    uint32_t depth_bits; // view z, whose bits order like it because it is positive
    uint32_t box;        // bins x0 | y0 << 8 | x1 << 16 | y1 << 24, inclusive, or kNoBins
};

// 16-bit code of the pixels that a small splat covers in an eye's picture; long lists read it in place of the splat
// (blend/cuda/touch.cuh). Fields: the first column of 4 pixels, modulo 16; number of further columns; the first row of
// pixels, modulo 64; number of further rows. In a bin 64 pixels off, whose list holds the splat for the other eye, the
// code names the same sub-tiles: there the splat is evaluated in vain, and counted.
constexpr uint32_t kTouchColumn = 4;          // pixels
constexpr uint32_t kTouchUnknown = 15u << 12; // a row count that no splat has: the splat itself tells
GSC_HD constexpr uint32_t touchCode(uint32_t column, uint32_t more_columns, uint32_t row, uint32_t more_rows)
{
    return (column & 15u) | more_columns << 4 | (row & 63u) << 6 | more_rows << 12;
}
// Index of a splat's code. slot: the splat's slot, counted over all lists.
GSC_HD constexpr size_t touchPlace(bool shared_bins, uint32_t eye, uint32_t slot)
{
    return shared_bins ? size_t(kMaxEyes) * slot + eye : slot;
}
constexpr float kTouchReach =
    6.0f; // largest reach of a splat with a code, pixels to each side: 4 columns, 13 rows at most

// Class of a piece of a bin's list, by length: sorted by one warp, by 2, 4, 8 or 16 warps, or longer.
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

constexpr uint32_t kBinClasses = 33; // classes of bins, by the highest bit of their count

struct Piece {
    uint32_t first, count; // range of the keys
};

// Up to kRunGroups groups of one chunk, which a warp tests together. Bounds are the chunk's: one load of them tells whether
// an eye may see any of its groups.
struct alignas(16) GroupRun {
    float anchor_min[3];
    float anchor_sigma_max;
    float anchor_max[3];
    float extra_level_max;
    uint32_t group_first;
    uint16_t group_count; // 1..
    uint16_t level_index;
    float gaussian_sigma_max;
    float gaussian_margin; // largest distance of a Gaussian's centre from the anchors' box, along any axis
};
constexpr uint32_t kRunGroups = 32;

// Device pointers. n = anchors of the model.
struct DeviceModel {
    ModelParams params;
    const LevelRecord* levels;
    const GroupRecord* groups;
    const GroupRun* runs;        // run_count, of all groups
    const float* lod_shift;      // per level record
    const uint32_t* level_first; // per level record: its first anchor
    const float* placement;      // n x 4: x, y, z, extra_level
    const float* size;           // n x 3: the anchor's own scale, for selection
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
    unsigned long long pairs[kMaxEyes]; // (bin, splat); 64 bits, since the 32-bit cells may overflow
    uint32_t slots[kMaxEyes];           // splat slots reserved, with gaps
    uint32_t gaps[kMaxEyes];            // reserved slots that stayed unused
    uint32_t anchors_listed;            // anchors listed for a pass, if there are several (select_cuda.h)
    uint32_t pieces[kPieceClasses], next_piece[kPieceClasses];
    uint32_t bin_classes[kBinClasses], queued[kBinClasses]; // fullest first
    uint32_t wide;                                          // splats of many bins, of which kWideSplats are listed
    uint32_t bins;                                          // queued bins: those of the columns that are drawn
    uint32_t long_bins;                                     // the first of `bins`: those with long lists (bin_cuda.h)
    uint32_t longest_bins;  // the first of `bins`: those with lists of kFirstUnits units or more
    uint32_t touch_units;   // units of long lists, for all their readers
    uint32_t next_anchors;  // work queue of decode
    uint32_t segment_pairs; // BlendCudaArgs::segment_pairs
    uint32_t segments_pushed, segments_taken, segments_finished; // SegmentQueue
    uint32_t next_tile[3], next_bin[2]; // work queues of blend: by LongPart; of colours and of depths
};

enum class Stage : uint32_t { Select, Decode, Bin, Sort, Blend, None };
constexpr uint32_t kStages = 6;

// FrameOptions::detail (kernels/coarse/coarse_cuda.h), 0 without it.
struct CoarseCounters {
    uint32_t near, drawn, wants; // lengths of the lists
    uint32_t granted_before;     // copies in buckets of urgency below this are made
    uint32_t evicted_from;       // copies not drawn for so many frames give up their pages; 0: none do
    uint32_t groups_near, groups_kept, groups_stale, groups_made;
    uint32_t anchors_made, anchors_kept, anchors_stale;
};

// Counters of the current frame; each frame's end copies them to the host, for its counts and to grow buffers.
struct FrameCounters {
    PassCounters pass;
    uint32_t groups_visible;           // groups that are to be looked at
    uint32_t anchors_listed;           // entries of the visible list
    uint32_t groups_tested[kMaxEyes];  // groups of the chunks that the eye may see
    uint32_t anchors_tested[kMaxEyes]; // anchors of the groups that are looked at
    uint32_t anchors_visible[kMaxEyes];
    uint32_t any_positive[kMaxEyes];    // an opacity above zero exists (trap 25), or may exist outside of the columns
    uint32_t splats[kMaxEyes];          // splats on screen
    uint32_t gaussians[kMaxEyes];       // Gaussians with opacity >= 1/255
    uint32_t dropped[kMaxEyes];         // Gaussians that are not finite
    uint32_t most_slots;                // most slots of a pass and a list
    uint32_t all_slots;                 // slots of all passes, without gaps, of the longer list
    unsigned long long most_pairs;      // most pairs of a pass
    unsigned long long pairs[kMaxEyes]; // with shared bins: all under the first eye
    unsigned long long evaluations[kMaxEyes];
    CoarseCounters coarse;
    uint32_t overflow;
    ColumnRange columns; // FrameOptions: select writes them here, since a captured graph keeps its arguments
    unsigned long long
        stage_ns[kStages]; // time of each stage that has ended (stage_clock_cuda.h); not cleared with the rest
};

// True if a buffer overflowed: the frame is drawn again, so its later stages can skip.
GSC_HD bool willRepeat(const FrameCounters& counters)
{
    return counters.overflow != 0;
}

} // namespace gsc
