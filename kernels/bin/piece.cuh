// SPDX-License-Identifier: Apache-2.0
// Cuts the lists of bins, from their cells, into pieces, and puts the bins into a queue. These kernels are short and
// wait for memory most of their time: what they read is loaded all at once, and one atomic operation serves as many
// threads as can share it.
#pragma once

#include "kernels/bin/bin_cuda.h"
#include "kernels/cuda/launch.cuh"
#include "kernels/cuda/ptx.cuh"
#include "kernels/cuda/warp_list.cuh"

namespace gsc {

namespace {

constexpr uint32_t kPieceWarps = 8; // warps of a block, each of which takes one bin
constexpr uint32_t kQueueThreads = 256;
constexpr uint32_t kNotDrawn = kBinClasses; // class of a bin that no eye draws
static_assert(kLensSquare == kBinWidth);    // a bin is as high as a square of the lens or half as high

// Returns true if one of the eyes that read the bin draws it: it lies in the columns that are drawn, which begin and
// end where bins do, and its lens shows it. `bin` is numbered through all lists.
__device__ __forceinline__ bool isDrawn(const BinCudaArgs& args, const ColumnRange& columns, uint32_t bin)
{
    if (columns.all() && !args.lens[0].masks && !args.lens[1].masks)
        return true;
    const uint32_t list = bin / args.grid.bins(), in_list = bin % args.grid.bins();
    const uint32_t column = in_list % args.grid.columns, row = in_list / args.grid.columns;
    bool drawn = false;
#pragma unroll
    for (uint32_t e = 0; e < kMaxEyes; ++e) {
        if (args.readers == 1 && e != list)
            continue;
        // wraps round to a large number left of the eye's image
        const uint32_t square = column - args.grid.shift[e], x = square * kBinWidth;
        drawn = drawn || ((columns.all() || (x >= columns.first && x < columns.end)) &&
                          args.lens[e].shows(square, row * args.grid.height / kLensSquare));
    }
    return drawn;
}

constexpr uint32_t kLaneCells = 4, kWarpCells = 32 * kLaneCells; // cells looked at together by a lane, by a warp

// Copies the ends of a bin's cells to `copy`, from where every lane can read them.
__device__ __forceinline__ void copyCells(const uint32_t* cells, uint32_t slabs, uint32_t* copy)
{
    constexpr uint32_t kAtOnce = 4; // reads that a lane has under way at once
#pragma unroll 1
    for (uint32_t first = (threadIdx.x & 31u) * kLaneCells; first < slabs; first += kAtOnce * kWarpCells) {
        uint4 ends[kAtOnce];
#pragma unroll
        for (uint32_t i = 0; i < kAtOnce; ++i)
            if (first + i * kWarpCells < slabs)
                ends[i] = *reinterpret_cast<const uint4*>(cells + first + i * kWarpCells);
#pragma unroll
        for (uint32_t i = 0; i < kAtOnce; ++i)
            if (first + i * kWarpCells < slabs)
                *reinterpret_cast<uint4*>(copy + first + i * kWarpCells) = ends[i];
    }
}

// Finds the runs of cells in a bin's list, each of which becomes a piece: a run has the cells whose starts, counted
// from `origin`, lie between the same two multiples of kPieceAim, and ends where the next run begins. A warp goes
// through the cells from near to far and returns the number of runs. cells: from copyCells(); the starts of the runs
// are written over it, never more than have been read. origin: start of the bin's list in `keys`.
__device__ __forceinline__ uint32_t listRuns(uint32_t* cells, uint32_t slabs, uint32_t origin)
{
    const uint32_t lane = threadIdx.x & 31u;
    // count: runs found so far. The cell before: (start - origin) / kPieceAim, and its end
    uint32_t count = 0, number_before = ~0u, end_before = origin;
#pragma unroll 1
    for (uint32_t first = 0; first < slabs; first += kWarpCells) {
        const bool is = first + lane * kLaneCells < slabs;
        const uint4 ends = is ? *reinterpret_cast<const uint4*>(cells + first + lane * kLaneCells) : uint4{};
        const int last = int(min(slabs / kLaneCells, 32u)) - 1; // last lane that has cells
        const uint32_t left_number = (ends.z - origin) / kPieceAim, last_number = __shfl_sync(~0u, left_number, last);
        const uint32_t last_end = __shfl_sync(~0u, ends.w, last);
        if (last_number != number_before) { // otherwise no run begins in these cells, since numbers never fall
            const uint32_t left_end = __shfl_up_sync(~0u, ends.w, 1), left = __shfl_up_sync(~0u, left_number, 1);
            const uint32_t start[kLaneCells] = {lane == 0 ? end_before : left_end, ends.x, ends.y, ends.z};
            uint32_t number = lane == 0 ? number_before : left, place = count, begins = 0;
#pragma unroll
            for (uint32_t i = 0; i < kLaneCells; ++i) {
                const uint32_t its = (start[i] - origin) / kPieceAim;
                const uint32_t all = __ballot_sync(~0u, is && its != number);
                begins |= (all >> lane & 1u) << i;
                place += __popc(all & ((1u << lane) - 1u));
                count += __popc(all);
                number = its;
            }
            __syncwarp(); // lanes write below where others have read
#pragma unroll
            for (uint32_t i = 0; i < kLaneCells; ++i)
                if (begins >> i & 1u)
                    cells[place++] = start[i];
        }
        number_before = last_number;
        end_before = last_end;
    }
    return count;
}

// Calls take(class, piece) for every run of a warp that has two keys or more; keys beyond pair_capacity are left out.
// end: end of the last run.
template <typename Take>
__device__ __forceinline__ void forPieces(const uint32_t* starts, uint32_t count, uint32_t end, uint32_t pair_capacity,
                                          Take take)
{
    for (uint32_t i = threadIdx.x & 31u; i < count; i += 32) {
        const uint32_t start = starts[i], stop = min(i + 1 < count ? starts[i + 1] : end, pair_capacity);
        if (stop >= start + 2)
            take(pieceClass(stop - start), Piece{start, stop - start});
    }
}

// A warp takes a bin; the warps of a block count their pieces together. Dynamic shared memory: a word for every cell.
__global__ void __launch_bounds__(kPieceWarps * 32) pieceKernel(const __grid_constant__ BinCudaArgs args)
{
    GSC_DYNAMIC_SHARED(all_starts);
    __shared__ uint32_t places[kPieceClasses], classes[kPieceWarps];
    const uint32_t warp = threadIdx.x / 32, lane = threadIdx.x & 31u, slabs = args.grid.slabs();
    const uint32_t bins = args.lists * args.grid.bins(), bin = blockIdx.x * kPieceWarps + warp;
    const uint32_t first = min(bin, bins - 1) * slabs; // all loads begin at once, before it is known which are needed
    uint32_t* const starts = reinterpret_cast<uint32_t*>(all_starts) + warp * slabs;
    const uint32_t origin = first == 0 ? 0u : loadNow(args.cells + first - 1),
                   end = loadNow(args.cells + first + slabs - 1);
    const ColumnRange columns = {loadNow(&args.counters->columns.first), loadNow(&args.counters->columns.end)};
    const bool repeats = willRepeat(*args.counters);
    copyCells(args.cells + first, slabs, starts);
    __syncwarp();
    if (repeats)
        return;
    const bool drawn = bin < bins && isDrawn(args, columns, bin); // if false nothing reads the order of the bin's list
    const uint32_t count = drawn ? listRuns(starts, slabs, origin) : 0u;
    if (lane == 0)
        classes[warp] = drawn ? uint32_t(__clz(int(end - origin))) : kNotDrawn;
    if (threadIdx.x < kPieceClasses)
        places[threadIdx.x] = 0;
    __syncthreads();
    forPieces(starts, count, end, args.pair_capacity,
              [&](uint32_t kind, const Piece&) { atomicAdd(places + kind, 1u); });
    __syncthreads();
    if (threadIdx.x < kPieceClasses && places[threadIdx.x] != 0)
        places[threadIdx.x] = atomicAdd(args.counters->pass.pieces + threadIdx.x, places[threadIdx.x]);
    if (warp == 1 && lane < kPieceWarps && blockIdx.x * kPieceWarps + lane < bins) {
        args.bin_class[blockIdx.x * kPieceWarps + lane] = classes[lane];
        if (classes[lane] != kNotDrawn)
            shareAtomic(args.counters->pass.bin_classes, classes[lane]);
    }
    __syncthreads();
    forPieces(starts, count, end, args.pair_capacity, [&](uint32_t kind, const Piece& piece) {
        args.pieces[size_t(kind) * args.piece_capacity + atomicAdd(places + kind, 1u)] = piece;
    });
}

// Units of the long lists that the lanes of a warp have, one list each. touchCapacity() has room for all units. All
// lanes of the warp call the functions together.
class UnitList {
public:
    // begin, end: range of the lane's list in `keys`; equal if the lane has none.
    __device__ __forceinline__ UnitList(const BinCudaArgs& args, uint32_t begin, uint32_t end)
        : m_begin(begin), m_end(end), m_each((end - begin + kTouchUnit - 1) / kTouchUnit),
          m_sum(sumUpTo(m_each * args.readers))
    {
        if ((threadIdx.x & 31u) == 31 && m_sum != 0)
            m_first = atomicAdd(&args.counters->pass.touch_units, m_sum);
    }

    // Writes the units of all lanes, shared out among the lanes, and returns the number of the first unit of this
    // lane's list. entry: number of the lane's list (list x bins + bin).
    __device__ __forceinline__ uint32_t write(const BinCudaArgs& args, uint32_t entry) const
    {
        const uint32_t lane = threadIdx.x & 31u, all = __shfl_sync(~0u, m_sum, 31);
        const uint32_t first = __shfl_sync(~0u, m_first, 31), before = m_sum - m_each * args.readers;
        for (uint32_t from = 0; from < all; from += 32) {
            const uint32_t i = from + lane;
            const int owner = ownerOf(i, m_sum);
            const uint32_t each = __shfl_sync(~0u, m_each, owner), its = i - __shfl_sync(~0u, before, owner);
            const uint32_t begin = __shfl_sync(~0u, m_begin, owner), end = __shfl_sync(~0u, m_end, owner);
            if (i >= all)
                continue;
            const uint32_t list = entry - lane + uint32_t(owner), at = begin + its % each * kTouchUnit;
            args.touch_units[first + i] = {list, args.readers > 1 ? its / each : list / args.grid.bins(), its % each,
                                           at, min(kTouchUnit, end - at)};
        }
        return m_each != 0 ? first + before : 0u;
    }

private:
    uint32_t m_begin, m_end, m_each, m_sum; // m_each: units of the lane's list for one reader
    uint32_t m_first = 0;                   // first place in touch_units that the warp has; only the last lane knows it
};

// Notes the buffer sizes that this pass needed. Reads all counters before it writes any, so it waits for memory once.
__device__ __forceinline__ void countPass(const BinCudaArgs& args)
{
    FrameCounters& counters = *args.counters;
    unsigned long long pairs[kMaxEyes], of_passes[kMaxEyes], all_pairs = 0, most_pairs = counters.most_pairs;
    uint32_t most_slots = counters.most_slots, used = 0;
    const uint32_t all_slots = counters.all_slots, overflow = counters.overflow;
#pragma unroll
    for (uint32_t e = 0; e < kMaxEyes; ++e) {
        const bool is = e < args.lists;
        const uint32_t slots = counters.pass.slots[e], gaps = counters.pass.gaps[e];
        pairs[e] = is ? counters.pass.pairs[e] : 0u;
        of_passes[e] = counters.pairs[e];
        all_pairs += pairs[e];
        most_slots = max(most_slots, is ? slots : 0u);
        used = max(used, is ? slots - gaps : 0u);
    }
#pragma unroll
    for (uint32_t e = 0; e < kMaxEyes; ++e)
        counters.pairs[e] = of_passes[e] + pairs[e];
    counters.most_slots = most_slots;
    counters.all_slots = all_slots + used;
    counters.most_pairs = all_pairs > most_pairs ? all_pairs : most_pairs;
    counters.overflow = overflow | (all_pairs > args.pair_capacity ? kPairOverflow : 0u);
}

// Sorts the bins by falling size, so that the longest lists are started first. The last block only counts.
__global__ void __launch_bounds__(kQueueThreads) queueKernel(const __grid_constant__ BinCudaArgs args)
{
    constexpr uint32_t kLongClass = 31 - kLongListBits;
    // class of bins whose lists have kFirstUnits units or more, some just as many
    constexpr uint32_t kLongestClass = 31 - kTouchUnitBits - kFirstUnitsBits;
    static_assert(kBinClasses == 33); // one class for each lane, and behind them the class of the empty bins
    PassCounters& pass = args.counters->pass;
    const uint32_t bins = args.lists * args.grid.bins(), bin = blockIdx.x * kQueueThreads + threadIdx.x;
    const uint32_t lane = threadIdx.x & 31u,
                   there = min(bin, bins - 1); // all loads are begun at once, before it is known which are needed
    const uint32_t of_class = pass.bin_classes[lane], empty = pass.bin_classes[32],
                   its_class = loadNow(args.bin_class + there);
    const uint32_t* const its_cells = args.cells + (there << args.grid.slab_bits);
    const uint32_t its_begin = there == 0 ? 0u : loadNow(its_cells - 1),
                   its_end = loadNow(its_cells + args.grid.slabs() - 1);
    unsigned long long pairs = 0;
#pragma unroll
    for (uint32_t e = 0; e < kMaxEyes; ++e) {
        const unsigned long long of_list = pass.pairs[e];
        pairs += e < args.lists ? of_list : 0u;
    }

    const uint32_t sum = sumUpTo(of_class), filled = __shfl_sync(~0u, sum, 31), classed = filled + empty;
    const uint32_t long_bins = __shfl_sync(~0u, sum, kLongClass), longest_bins = __shfl_sync(~0u, sum, kLongestClass);
    if (blockIdx.x == gridDim.x - 1) {
        if (threadIdx.x != 0)
            return;
        countPass(args);
        pass.bins = classed;
        pass.long_bins = long_bins;
        pass.longest_bins = longest_bins;
        return;
    }
    const uint32_t kind =
        bin < bins && classed != 0 ? its_class : kNotDrawn; // no class is counted in a frame that will be drawn again
    const uint32_t before_it = __shfl_sync(~0u, sum - of_class, kind & 31u), before = kind < 32 ? before_it : filled;
    SharedAtomic queued{};
    if (kind != kNotDrawn)
        queued = shareAtomic(pass.queued, kind);
    // false if there are more pairs than room: the frame is then drawn again
    const bool is_long = kind <= kLongClass && pairs <= args.pair_capacity;
    const UnitList units(args, is_long ? its_begin : 0u, is_long ? its_end : 0u);
    if (kind != kNotDrawn) {
        args.bin_queue[before + queued.mine()] = bin;
#pragma unroll
        for (uint32_t reader = 0; reader < kMaxEyes; ++reader)
            if (reader < args.readers)
                args.unfinished[reader * bins + bin] = 0;
    }
    const uint32_t first_unit = units.write(args, bin);
    if (kind != kNotDrawn)
        args.bin_units[bin] = first_unit;
}

} // namespace

} // namespace gsc
