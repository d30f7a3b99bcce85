// SPDX-License-Identifier: Apache-2.0
// The model as the CUDA stages read it: flat arrays over all anchors, in file order. Plain data, no CUDA header.
#pragma once

#include "format/numbers/compact.h"
#include <gsc/frame_types.h>
#include "kernels/math/eye.h"

namespace gsc {

constexpr uint32_t kAnchorBits = 30; // bits of an anchor's number in a visible list: anchor | eyes << kAnchorBits
constexpr uint32_t kBinWidth = 32;   // width of a bin in pixels
static_assert(kColumnStep == kBinWidth);
constexpr uint32_t kMaxBins = 255;        // largest number of bins along an axis, so that bin coordinates fit bytes
constexpr uint32_t kNoBins = 0x0000ffffu; // SplatPlace::box of a slot that holds no splat: x0 = y0 = 255, x1 = y1 = 0
// Offset of a Gaussian in 64 bits: x, y and z from the low bits on, 21 bits each, counted from -2^20, in steps that
// depend on the anchor's largest offset. That is so fine that the depth order of hardly any two Gaussians changes; a
// changed order would be the most visible rounding of the tier `fast`.
constexpr uint32_t kOffsetBits = 21;
constexpr int32_t kOffsetSteps = (1 << (kOffsetBits - 1)) - 1; // number of steps of the anchor's largest offset
constexpr uint64_t kNoOffset = 0; // value of an offset that is not finite: its Gaussian is dropped and counted
// bit that is set in the offset of a masked slot: the Gaussian is neither drawn nor counted
constexpr uint64_t kMaskedSlot = 1ull << 63;
constexpr uint32_t kDepthBuckets = 32768; // buckets of the depth histogram: 1024 for each octave of view z
constexpr uint32_t kMaxSlabs = 1024;      // largest number of slabs of a pass
constexpr uint32_t kMaxPasses = 31;       // largest number of passes, such that kMaxPasses x kMaxSlabs fits 16 bits

// Sizes of an anchor of a compact model (kModelCompact): 8 bytes in place of DeviceModel::shape. An extent is a float
// without a sign, of 6 bits of exponent and 10 of mantissa.
struct alignas(8) CompactShape {
    uint16_t extent[3];                 // base sizes of the anchor's Gaussians, packExtent()
    int8_t feature_power, offset_power; // exponents of the power of two that is the step of features, and of offsets
};
constexpr uint32_t kExtentLeast = 87; // biased exponent of the smallest extent, 2^-40
// Offset of a Gaussian of a compact model in 32 bits: x, y and z from the low bits on, 10 bits each, in steps counted
// from -512. kCompactNoOffset: not finite; kCompactMasked: set for a masked slot.
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

// Cut of an eye's image into bins of kBinWidth x height pixels, each of which is cut in depth into slabs. A cell is one
// slab of one bin. Cells are numbered by eye, then bin, then slab from near to far. Two eyes that look the same way may
// share bins: the depth order is then equal for both, and there is one list of splats per bin instead of two.
struct BinGrid {
    uint32_t columns, rows, height; // columns, rows: numbers of bins; height: of a bin, 16 or 32 pixels
    uint32_t slab_bits;             // there are 2^slab_bits slabs, at least 4
    uint32_t shift[kMaxEyes] = {};  // column of bins at which the eye's image begins; 0 unless bins are shared

    bool operator==(const BinGrid&) const = default;
    [[nodiscard]] GSC_HD uint32_t slabs() const { return 1u << slab_bits; }
    [[nodiscard]] GSC_HD uint32_t bins() const { return columns * rows; }
    [[nodiscard]] GSC_HD uint32_t cells() const { return columns * rows << slab_bits; }
};

// One of the passes in which a frame is drawn, from near to far; each decodes, sorts and blends the Gaussians of its
// depths, so that a frame's memory is bounded whatever it shows. The image does not depend on the number of passes
// (except at the ends of needles, kernels/README.md).
struct DepthPass {
    const uint16_t* slab_of; // for each of kDepthBuckets depths the number of its slab, counted over all passes
    uint32_t index, count;
};

// Place of a splat on the screen, written by decode and read when lists of bins are made. With shared bins it is the
// place in both eyes' images.
struct alignas(8) SplatPlace {
    uint32_t depth_bits; // bits of view z, which as integers have the order of the depths, since these are positive
    uint32_t box;        // bins x0 | y0 << 8 | x1 << 16 | y1 << 24, ends inclusive; or kNoBins
};

// Code of 16 bits that tells which pixels a small splat covers in an eye's picture; long lists read it in place of the
// splat (blend/cuda/touch.cuh). Its fields: first column of 4 pixels, modulo 16; number of further columns; first row
// of pixels, modulo 64; number of further rows. In a bin 64 pixels away, whose list has the splat because of the other
// eye, the code names the same sub-tiles: there the splat is evaluated in vain, and counted.
constexpr uint32_t kTouchColumn = 4;          // width in pixels of a column in a touch code
constexpr uint32_t kTouchUnknown = 15u << 12; // a number of rows that no splat has: the splat itself must be read
GSC_HD constexpr uint32_t touchCode(uint32_t column, uint32_t more_columns, uint32_t row, uint32_t more_rows)
{
    return (column & 15u) | more_columns << 4 | (row & 63u) << 6 | more_rows << 12;
}
// Index in `touches` of a splat's code. slot: splat slot, counted over all lists.
GSC_HD constexpr size_t touchPlace(bool shared_bins, uint32_t eye, uint32_t slot)
{
    return shared_bins ? size_t(kMaxEyes) * slot + eye : slot;
}
constexpr float kTouchReach =
    6.0f; // largest reach, in pixels to each side, of a splat that has a code: it covers at most 4 columns and 13 rows

// Pieces of bins' lists are divided into classes by their length: those that one warp can sort, those for 2, 4, 8 and
// 16 warps, and longer ones.
constexpr uint32_t kWarpPiece = 512; // largest number of keys in a piece that one warp sorts
constexpr uint32_t kPieceClasses = 6;
GSC_HD constexpr uint32_t pieceClass(uint32_t keys)
{
    uint32_t kind = 0;
    while (kind < kPieceClasses - 1 && keys > kWarpPiece << kind)
        ++kind;
    return kind;
}
constexpr uint32_t kPieceAim = 384; // keys that a piece should have; its last cell can add more

constexpr uint32_t kBinClasses = 33; // classes of bins, by the leading zeros of the number of splats in the bin

struct Piece {
    uint32_t first, count; // range of the piece in `keys`
};

// Up to kRunGroups groups of one chunk, which a warp tests together. The bounds are those of the chunk: one load of
// them tells whether an eye may see any of the groups.
struct alignas(16) GroupRun {
    float anchor_min[3];
    float anchor_sigma_max;
    float anchor_max[3];
    float extra_level_max;
    uint32_t group_first;
    uint16_t group_count; // number of groups, 1 to kRunGroups
    uint16_t level_index;
    float gaussian_sigma_max;
    // largest distance of a Gaussian's centre from the box of the anchors, along any axis, world units
    float gaussian_margin;
};
constexpr uint32_t kRunGroups = 32;

// The model in device memory; all pointers are device pointers. n = number of anchors, F and K as in ModelParams.
struct DeviceModel {
    ModelParams params;
    const LevelRecord* levels;
    const GroupRecord* groups;
    const GroupRun* runs;        // run_count runs, which hold all groups
    const float* lod_shift;      // for each LevelRecord: lodShift() of the level
    const uint32_t* level_first; // for each LevelRecord: number of its first anchor
    const float* placement;      // n x 4 values: x, y, z, extra_level of each anchor
    const float* size;           // n x 3 values: factors of the anchor's offsets, by which it is selected, world units
    const float* shape;          // n x 6 values: world units per step of `offset`, base size of the Gaussians
    const float* rotation;       // n x 4 values, w x y z; null if all are params.constant_rotation
    const uint16_t* feature;     // n x F half floats: features of the anchors
    const uint64_t* offset;      // n x K offsets, see kOffsetBits
    const uint32_t* source;      // n values: source index of each anchor
    // Arrays of a compact model, in place of shape, feature and offset, which are null there. Null in other models.
    const CompactShape* compact_shape; // n elements, one for each anchor
    // n x F / 4 words: four features of 8 bits, from the low bits on, each its number of steps + 128
    const uint32_t* compact_feature;
    const uint32_t* compact_offset; // n x K offsets, see kCompactNoOffset
    uint32_t run_count;
    uint32_t anchor_count;
};

// Bits of FrameCounters::overflow, each for a buffer that was too small.
constexpr uint32_t kVisibleOverflow = 1u, kSlotOverflow = 2u, kPairOverflow = 4u;

// Counters of a pass, cleared before it. With shared bins, counters per eye count for both eyes in the first element.
struct PassCounters {
    // numbers of (bin, splat) pairs, in 64 bits, since the 32-bit counters of cells may overflow
    unsigned long long pairs[kMaxEyes];
    uint32_t slots[kMaxEyes]; // numbers of splat slots that were reserved, with gaps
    uint32_t gaps[kMaxEyes];  // numbers of splat slots that were reserved and stayed unused
    uint32_t anchors_listed;  // anchors in the list of the pass, if there are several passes (select_cuda.h)
    uint32_t pieces[kPieceClasses], next_piece[kPieceClasses];
    // numbers of bins by class, and how many of each are queued; the fullest bins are in the first classes
    uint32_t bin_classes[kBinClasses], queued[kBinClasses];
    uint32_t wide;          // splats that touch many bins; at most kWideSplats of them are listed
    uint32_t bins;          // number of bins in the queue: those in the columns that are drawn
    uint32_t long_bins;     // number of bins at the head of the queue that have long lists (bin_cuda.h)
    uint32_t longest_bins;  // number of bins at the head of the queue whose lists have kFirstUnits units or more
    uint32_t touch_units;   // number of units in long lists, for all eyes that read them
    uint32_t next_anchors;  // next item in the work queue of decode
    uint32_t segment_pairs; // number of entries in BlendCudaArgs::segment_pairs
    uint32_t segments_pushed, segments_taken, segments_finished; // counts of SegmentQueue
    // next items in the work queues of blending: long lists by LongPart; short lists for colours, and for depths
    uint32_t next_tile[3], next_bin[2];
};

enum class Stage : uint32_t { Select, Decode, Bin, Sort, Blend, None };
constexpr uint32_t kStages = 6;

// Counters for FrameOptions::detail (kernels/coarse/coarse_cuda.h); all are 0 in a frame without detail.
struct CoarseCounters {
    uint32_t near, drawn, wants; // lengths of the lists near, drawn and wants of CoarseTables
    uint32_t granted_before;     // bucket of urgency below which copies are made
    uint32_t evicted_from; // number of frames without being drawn after which a copy gives up its pages; 0: none does
    uint32_t groups_near, groups_kept, groups_stale, groups_made;
    uint32_t anchors_made, anchors_kept, anchors_stale;
};

// Counters of the current frame. When it ends they are copied to the host, which reports them and enlarges buffers.
struct FrameCounters {
    PassCounters pass;
    uint32_t groups_visible;           // number of groups that passed the test of their bounds
    uint32_t anchors_listed;           // number of entries in the visible list
    uint32_t groups_tested[kMaxEyes];  // for each eye: groups of the chunks that it may see
    uint32_t anchors_tested[kMaxEyes]; // for each eye: anchors of the groups that passed their test
    uint32_t anchors_visible[kMaxEyes];
    // not 0 if an opacity above zero exists (format facts, trap 25), or may exist outside of the drawn columns
    uint32_t any_positive[kMaxEyes];
    uint32_t splats[kMaxEyes];     // for each eye: splats on the screen
    uint32_t gaussians[kMaxEyes];  // for each eye: Gaussians with an opacity of 1/255 or more
    uint32_t dropped[kMaxEyes];    // for each eye: Gaussians that were dropped because they are not finite
    uint32_t most_slots;           // largest number of splat slots that one pass took in one list
    uint32_t all_slots;            // splat slots of all passes without gaps, of the list with more of them
    unsigned long long most_pairs; // largest number of pairs in one pass
    // (bin, splat) pairs of all passes; with shared bins those of both eyes are in the first element
    unsigned long long pairs[kMaxEyes];
    unsigned long long evaluations[kMaxEyes];
    CoarseCounters coarse;
    uint32_t overflow;
    // copy of FrameOptions::columns, written by select, since a captured graph keeps its arguments
    ColumnRange columns;
    unsigned long long
        stage_ns[kStages]; // nanoseconds of each ended stage (stage_clock_cuda.h); not cleared with the rest
};

// Returns true if a buffer overflowed: the frame will be drawn again, so its later stages can do nothing.
GSC_HD bool willRepeat(const FrameCounters& counters)
{
    return counters.overflow != 0;
}

} // namespace gsc
