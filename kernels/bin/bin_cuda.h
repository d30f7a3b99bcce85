// SPDX-License-Identifier: Apache-2.0
// Splats of all eyes to the lists of their bins, on the device: a counting sort over cells (bins cut in depth), so that
// a bin's list comes out cut into short pieces from near to far however many splats share the bin.
#pragma once

#include "kernels/frame/device_model.h"

#include <cstddef>

struct CUstream_st;

namespace gsc {

struct BinKey {
    uint32_t depth_bits;
    uint32_t slot; // of the splat, counted over all lists
};

// Part of a bin's list that is so long that the block that blended it would be the last to finish by far.
struct ListSegment {
    uint32_t entry, eye;       // list x bins + bin; who reads it
    uint32_t number, count;    // of `count` of the list, from near to far; 0: none
    uint32_t first;            // index of the list's segment 0
    uint32_t length;           // keys, of all but the last
    uint32_t blended, settled; // of segment 0: how many of the list are done, once and for good
};

constexpr uint32_t kSplitBin = 1u << 31; // in the queue: its list is cut into segments

struct BinCudaArgs {
    BinGrid grid;
    uint32_t lists;           // per bin: one for every eye, or one for both
    uint32_t readers;         // eyes that blend each list
    const SplatPlace* places; // lists x slot_capacity
    uint32_t slot_capacity;
    DepthPass pass;
    uint32_t* cells; // lists x grid.cells(): counts; afterwards the end of each cell in `keys`
    BinKey* keys;    // pair_capacity; unordered within a cell
    uint32_t pair_capacity;
    uint32_t* bin_class; // lists x grid.bins(): leading zeros of the count
    uint32_t* bin_queue; // lists x grid.bins(): list x bins + bin, fullest first; kSplitBin
    ListSegment* segments;
    uint32_t segment_capacity; // 0: no list is cut
    Piece* pieces;             // kPieceClasses x piece_capacity
    uint32_t piece_capacity;
    void* scratch; // binScratchBytes()
    size_t scratch_bytes;
    FrameCounters* counters;
};

struct SlabCudaArgs {
    const uint32_t* histogram; // kDepthBuckets: depths of the visible anchors
    uint16_t* slab_of;         // kDepthBuckets
    uint32_t slabs;            // of all passes together
};

// Slabs of about equal load. Asynchronous.
void slabCuda(const SlabCudaArgs& args, CUstream_st* stream);

size_t binScratchBytes(uint32_t cells);
// Pieces that a frame can have at most, of every class.
uint32_t pieceCapacity(uint32_t bins, uint32_t pairs);

// Segments that a pass can have at most.
uint32_t segmentCapacity(uint32_t readers, uint32_t pairs, uint32_t processors);

void binCuda(const BinCudaArgs& args, uint32_t processors, CUstream_st* stream); // asynchronous

} // namespace gsc
