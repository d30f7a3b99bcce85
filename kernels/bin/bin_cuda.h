// SPDX-License-Identifier: Apache-2.0
// Splats of all eyes to the lists of their bins, on the device: a counting sort over cells (bins cut in depth), so that
// a bin's list comes out cut into short pieces from near to far however many splats share the bin.
#pragma once

#include "kernels/frame/device_model.h"
#include "kernels/sort/sort_key.h"

#include <cstddef>

struct CUstream_st;

namespace gsc {

// A list with at least this many keys is long: the pixels that its splats touch are found before it is blended, in
// units of kTouchUnit keys.
constexpr uint32_t kLongListBits = 10, kLongList = 1u << kLongListBits;
constexpr uint32_t kTouchUnitBits = 11, kTouchUnit = 1u << kTouchUnitBits;
// units of a list whose pixels are found before those of later units
constexpr uint32_t kFirstUnitsBits = 4, kFirstUnits = 1u << kFirstUnitsBits;

constexpr uint32_t kWideSplats = 1u << 12; // most splats of a pass that touch many bins and get a list of their own

// Part of a long list, for one of the eyes that read it.
struct TouchUnit {
    uint32_t entry, eye;   // list x bins + bin; who reads it
    uint32_t number;       // in its list
    uint32_t first, count; // range of the keys
};

struct BinCudaArgs {
    BinGrid grid;
    uint32_t lists;   // per bin: one for every eye, or one for both
    uint32_t readers; // eyes that blend each list
    LensShape lens[kMaxEyes];
    const SplatPlace* places; // lists x slot_capacity
    uint32_t slot_capacity;
    DepthPass pass;
    uint32_t* cells; // lists x grid.cells(): counts; afterwards the end of each cell in `keys`
    SortKey* keys;   // pair_capacity; unordered within a cell
    uint32_t pair_capacity;
    uint32_t* wide;         // kWideSplats: splats of many bins
    uint32_t* bin_class;    // lists x grid.bins(): leading zeros of the count
    uint32_t* bin_queue;    // lists x grid.bins(): list x bins + bin, fullest first
    uint32_t* bin_units;    // lists x grid.bins(): a long list's first unit; those of a reader follow each other
    TouchUnit* touch_units; // touchCapacity()
    uint32_t* unfinished;   // readers x lists x grid.bins(): zero afterwards for bins that are drawn
    Piece* pieces;          // kPieceClasses x piece_capacity
    uint32_t piece_capacity;
    void* scratch; // binScratchBytes()
    size_t scratch_bytes;
    FrameCounters* counters;
};

struct SlabCudaArgs {
    const uint32_t* histogram; // kDepthBuckets: depths of the visible anchors
    uint16_t* slab_of;         // kDepthBuckets
    uint32_t slabs;            // slabs of all passes together
};

// Slabs of about equal load. Asynchronous.
void slabCuda(const SlabCudaArgs& args, CUstream_st* stream);

size_t binScratchBytes(uint32_t cells);
// Pieces that a frame can have at most, of every class.
uint32_t pieceCapacity(uint32_t bins, uint32_t pairs);

// Units that a pass can have at most.
uint32_t touchCapacity(uint32_t readers, uint32_t bins, uint32_t pairs);

void binCuda(const BinCudaArgs& args, uint32_t processors, CUstream_st* stream); // asynchronous

} // namespace gsc
