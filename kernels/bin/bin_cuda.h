// SPDX-License-Identifier: Apache-2.0
// Lists the splats of every bin, for all eyes, on a device. It is a counting sort over cells (bins cut in depth), so
// that each list comes out cut into short pieces from near to far, however many splats it has.
#pragma once

#include "kernels/frame/device_model.h"
#include "kernels/sort/sort_key.h"

#include <cstddef>

struct CUstream_st;

namespace gsc {

// A list with at least kLongList splats is long: before it is blended, the pixels that its splats touch are found, in
// units of kTouchUnit splats.
constexpr uint32_t kLongListBits = 10, kLongList = 1u << kLongListBits;
constexpr uint32_t kTouchUnitBits = 11, kTouchUnit = 1u << kTouchUnitBits;
// number of units of a list whose pixels are found first; those of later units are found only if the list is not
// finished then
constexpr uint32_t kFirstUnitsBits = 4, kFirstUnits = 1u << kFirstUnitsBits;

// largest number of splats in a pass that touch many bins and are therefore listed in `wide`
constexpr uint32_t kWideSplats = 1u << 12;

// One unit of a long list, for one of the eyes that read the list.
struct TouchUnit {
    // entry: number of the list among those of both eyes (list x bins + bin); eye: the one that reads the list
    uint32_t entry, eye;
    uint32_t number;       // number of the unit in its list, from 0
    uint32_t first, count; // range of the unit in `keys`
};

struct BinCudaArgs {
    BinGrid grid;
    uint32_t lists;   // lists per bin: one for each eye, or one for both eyes
    uint32_t readers; // number of eyes that blend each list
    LensShape lens[kMaxEyes];
    const SplatPlace* places; // lists x slot_capacity splats
    uint32_t slot_capacity;
    DepthPass pass;
    uint32_t* cells; // lists x grid.cells() elements: first counts, afterwards the end of each cell in `keys`
    SortKey* keys;   // pair_capacity elements; not sorted within a cell
    uint32_t pair_capacity;
    uint32_t* wide;      // splats that touch many bins, room for kWideSplats
    uint32_t* bin_class; // lists x grid.bins() elements: leading zeros of the number of splats in the bin
    uint32_t* bin_queue; // lists x grid.bins() elements: numbers of the lists (list x bins + bin), the fullest first
    // lists x grid.bins() elements: first unit of a long list; the units of one reader follow each other
    uint32_t* bin_units;
    TouchUnit* touch_units; // touchCapacity() elements: units of the long lists
    uint32_t* unfinished;   // readers x lists x grid.bins() elements: set to zero for the bins that are drawn
    Piece* pieces;          // kPieceClasses x piece_capacity elements: the pieces of each class
    uint32_t piece_capacity;
    void* scratch; // binScratchBytes() bytes for sums over the cells
    size_t scratch_bytes;
    FrameCounters* counters;
};

struct SlabCudaArgs {
    const uint32_t* histogram; // kDepthBuckets elements: numbers of visible anchors by depth
    uint16_t* slab_of;         // kDepthBuckets elements: slab of each bucket of depths
    uint32_t slabs;            // number of slabs, those of all passes together
};

// Cuts the depths into slabs of about equal load. Asynchronous.
void slabCuda(const SlabCudaArgs& args, CUstream_st* stream);

size_t binScratchBytes(uint32_t cells);
// Largest number of pieces that a frame can have in each class.
uint32_t pieceCapacity(uint32_t bins, uint32_t pairs);

// Largest number of units that a pass can have.
uint32_t touchCapacity(uint32_t readers, uint32_t bins, uint32_t pairs);

void binCuda(const BinCudaArgs& args, uint32_t processors, CUstream_st* stream); // makes all bins' lists; asynchronous

} // namespace gsc
