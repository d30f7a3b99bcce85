// SPDX-License-Identifier: Apache-2.0
#include "kernels/bin/bin_cuda.h"

#include "kernels/cuda/depth_cells.cuh"
#include "kernels/cuda/launch.cuh"

#include <cub/block/block_scan.cuh>
#include <cub/device/device_scan.cuh>

#include <algorithm>

namespace gsc {

namespace {

constexpr uint32_t kSlabBlock = 512; // threads, a bucket each
static_assert(kDepthBuckets % (4 * kSlabBlock) == 0);
constexpr uint32_t kThreads = 256;
constexpr uint32_t kBlocksPerProcessor = 8; // all that a multiprocessor holds
constexpr uint32_t kScatterBlocks = 6;      // of a multiprocessor: 40 registers
// Splats of so many bins are not the work of the warp that meets them, which would be the last to end: near ones lie in
// slots beside each other.
constexpr uint32_t kManyBins = 128, kWideParts = 4;

// The part of all of a histogram's counts that lies before the middle of each bucket; never falls. Below zero if there are
// none. A bucket per thread; a block adds up all of the histogram by itself: it is small, and nothing waits for another
// block.
__device__ float middleOf(const uint32_t* histogram)
{
    using Scan = cub::BlockScan<uint32_t, kSlabBlock>;
    __shared__ typename Scan::TempStorage scratch;
    __shared__ uint32_t first, all; // counts before this block's buckets, and of all
    if (threadIdx.x == 0)
        first = all = 0;
    __syncthreads();
    const uint4* fours = reinterpret_cast<const uint4*>(histogram);
    uint32_t sum = 0, sum_before = 0;
#pragma unroll
    for (uint32_t i = 0; i < kDepthBuckets / 4 / kSlabBlock; ++i) {
        const uint32_t four = i * kSlabBlock + threadIdx.x;
        const uint4 c = fours[four];
        const uint32_t count = c.x + c.y + c.z + c.w;
        sum += count;
        sum_before += four < blockIdx.x * kSlabBlock / 4 ? count : 0u;
    }
    sum = __reduce_add_sync(~0u, sum);
    sum_before = __reduce_add_sync(~0u, sum_before);
    if ((threadIdx.x & 31u) == 0) {
        atomicAdd(&all, sum);
        atomicAdd(&first, sum_before);
    }
    const uint32_t count = histogram[blockIdx.x * kSlabBlock + threadIdx.x];
    uint32_t before, of_block;
    Scan(scratch).ExclusiveSum(count, before, of_block);
    __syncthreads();
    return all != 0 ? (float(first + before) + 0.5f * float(count)) / float(all) : -1.0f;
}

// A bucket goes to the slab its middle falls into.
__global__ void __launch_bounds__(kSlabBlock) slabKernel(const __grid_constant__ SlabCudaArgs args)
{
    const uint32_t slab = uint32_t(fmaxf(middleOf(args.histogram), 0.0f) * float(args.slabs));
    args.slab_of[blockIdx.x * kSlabBlock + threadIdx.x] = uint16_t(min(slab, args.slabs - 1));
}

// What the lanes of a warp that count in the same place get: one atomic served them all.
struct SharedAtomic {
    uint32_t first, peers;

    // Of this lane. The peers call it together.
    __device__ __forceinline__ uint32_t mine() const
    {
        const int leader = __ffs(int(peers)) - 1;
        return __shfl_sync(peers, first, leader) + __popc(peers & ((1u << (threadIdx.x & 31u)) - 1u));
    }
};

// counters[kind]++ of every active lane, one atomic per value of `kind` in the warp.
__device__ __forceinline__ SharedAtomic shareAtomic(uint32_t* counters, uint32_t kind)
{
    const uint32_t peers = __match_any_sync(__activemask(), kind);
    uint32_t first = 0;
    if ((threadIdx.x & 31u) == uint32_t(__ffs(int(peers)) - 1))
        first = atomicAdd(counters + kind, uint32_t(__popc(peers)));
    return {first, peers};
}

__global__ void __launch_bounds__(kThreads, kScatterBlocks) scatterKernel(const __grid_constant__ BinCudaArgs args)
{
    if (willRepeat(*args.counters))
        return;
    const uint32_t e = blockIdx.y, count = min(args.counters->pass.slots[e], args.slot_capacity);
    const uint32_t base = e * args.slot_capacity;
    uint32_t* cells = args.cells + size_t(e) * args.grid.cells();
    // whole warps stay in the loop: they work together
    const uint32_t lane = threadIdx.x & 31u, step = gridDim.x * kThreads;
    const auto placeAt = [&](uint32_t i) { return i < count ? args.places[base + i] : SplatPlace{0, kNoBins}; };
    uint32_t first = blockIdx.x * kThreads + (threadIdx.x & ~31u);
    SplatPlace next = placeAt(first + lane);
    for (; first < count; first += step) {
        SplatPlace place = next;
        next = placeAt(first + step + lane);
        if (place.box != kNoBins && binCount(place.box) > kManyBins) {
            const uint32_t at = atomicAdd(&args.counters->pass.wide, 1u);
            if (at < kWideSplats) {
                args.wide[at] = base + first + lane;
                place.box = kNoBins;
            }
        }
        forCellsOfWarp<4>(
            args.grid, args.pass.slab_of, place, base + first + lane,
            [&](uint32_t cell) { return shareAtomic(cells, cell); },
            [&](uint32_t cell) {
                return SharedAtomic{atomicAdd(cells + cell, 1u), 1u << lane};
            },
            [&](const SharedAtomic& taken, uint32_t depth_bits, uint32_t slot) {
                const uint32_t at = taken.mine();
                if (at < args.pair_capacity)
                    args.keys[at] = {depth_bits, slot};
            });
    }
}

// A block takes a part of a splat that scatterKernel() left.
__global__ void __launch_bounds__(kThreads) scatterWideKernel(const __grid_constant__ BinCudaArgs args)
{
    if (willRepeat(*args.counters))
        return;
    const uint32_t parts = min(args.counters->pass.wide, kWideSplats) * kWideParts;
    for (uint32_t part = blockIdx.x; part < parts; part += gridDim.x) {
        const uint32_t slot = args.wide[part / kWideParts];
        const SplatPlace place = args.places[slot];
        const uint32_t x0 = place.box & 255u, y0 = place.box >> 8 & 255u, width = (place.box >> 16 & 255u) - x0 + 1;
        uint32_t* cells = args.cells + size_t(slot / args.slot_capacity) * args.grid.cells() +
                          (args.pass.slab_of[depthBucket(place.depth_bits)] & (args.grid.slabs() - 1));
        const uint32_t bins = binCount(place.box);
        for (uint32_t i = part % kWideParts * kThreads + threadIdx.x; i < bins; i += kWideParts * kThreads) {
            const uint32_t bin = (y0 + i / width) * args.grid.columns + x0 + i % width;
            const uint32_t at = atomicAdd(cells + (bin << args.grid.slab_bits), 1u);
            if (at < args.pair_capacity)
                args.keys[at] = {place.depth_bits, slot};
        }
    }
}

constexpr uint32_t kCellsPerThread = 4;
constexpr uint32_t kNotDrawn = kBinClasses; // class of a bin that no eye shows
static_assert(kLensSquare == kBinWidth);    // and bins are as high or half as high

// Does one of the eyes that read it show bin `bin` of all lists: among the columns that are drawn, which begin and end where
// bins do, and behind its lens?
__device__ __forceinline__ bool isDrawn(const BinCudaArgs& args, uint32_t bin)
{
    const ColumnRange& columns = args.counters->columns;
    if (columns.all() && !args.lens[0].masks && !args.lens[1].masks)
        return true;
    const uint32_t list = bin / args.grid.bins(), in_list = bin % args.grid.bins();
    const uint32_t column = in_list % args.grid.columns, row = in_list / args.grid.columns;
    bool drawn = false;
#pragma unroll
    for (uint32_t e = 0; e < kMaxEyes; ++e) {
        if (args.readers == 1 && e != list)
            continue;
        const uint32_t square = column - args.grid.shift[e], x = square * kBinWidth; // left of the eye's image large
        drawn = drawn || ((columns.all() || (x >= columns.first && x < columns.end)) &&
                          args.lens[e].shows(square, row * args.grid.height / kLensSquare));
    }
    return drawn;
}

// A piece is the run of a bin's cells whose starts, counted from the bin's, fall into one multiple of kPieceAim. The
// thread of a run's first cell writes it.
__global__ void __launch_bounds__(kThreads) pieceKernel(const __grid_constant__ BinCudaArgs args)
{
    if (willRepeat(*args.counters))
        return;
    const uint32_t slabs = args.grid.slabs(), cell_count = args.lists * args.grid.cells();
    const uint32_t* ends = args.cells;
    const auto endBefore = [&](uint32_t cell) { return cell == 0 ? 0u : ends[cell - 1]; };
    for (uint32_t four = (blockIdx.x * kThreads + threadIdx.x) * kCellsPerThread; four < cell_count;
         four += gridDim.x * kThreads * kCellsPerThread) {
        const uint32_t first = four & ~(slabs - 1), origin = endBefore(first);
        const uint4 e = *reinterpret_cast<const uint4*>(ends + four);
        const bool drawn = isDrawn(args, first >> args.grid.slab_bits);
        const uint32_t starts[kCellsPerThread] = {endBefore(four), e.x, e.y, e.z};
        uint32_t previous = four == first ? ~0u : (endBefore(four - 1) - origin) / kPieceAim;
        if (four == first) {
            const uint32_t bin = four >> args.grid.slab_bits;
            const uint32_t kind = drawn ? uint32_t(__clz(int(ends[first + slabs - 1] - origin))) : kNotDrawn;
            args.bin_class[bin] = kind;
            if (drawn)
                shareAtomic(args.counters->pass.bin_classes, kind);
        }
        if (!drawn) // nothing reads its order
            continue;
        if (starts[0] == e.w && previous != ~0u) // nothing here, and no number changes within
            if ((starts[0] - origin) / kPieceAim == previous)
                continue;
#pragma unroll
        for (uint32_t i = 0; i < kCellsPerThread; ++i) {
            const uint32_t start = starts[i], number = (start - origin) / kPieceAim;
            if (number == previous)
                continue;
            previous = number;
            uint32_t low = four + i, high = first + slabs; // the last cell of the run, and one past
            while (high - low > 1) {
                const uint32_t mid = (low + high) / 2;
                if ((endBefore(mid) - origin) / kPieceAim == number)
                    low = mid;
                else
                    high = mid;
            }
            const uint32_t end = min(ends[low], args.pair_capacity);
            if (end < start + 2)
                continue;
            const uint32_t kind = pieceClass(end - start);
            const uint32_t at = shareAtomic(args.counters->pass.pieces, kind).mine();
            args.pieces[size_t(kind) * args.piece_capacity + at] = {start, end - start};
        }
    }
}

// Lists the units of the long lists that the lanes of a warp have, and returns the lane's first. begin, end: of its list;
// equal if it has none. There is room for all (touchCapacity()). All lanes of the warp call it together.
__device__ uint32_t listUnits(const BinCudaArgs& args, uint32_t entry, uint32_t begin, uint32_t end)
{
    const uint32_t lane = threadIdx.x & 31u, units = (end - begin + kTouchUnit - 1) / kTouchUnit * args.readers;
    const uint32_t first = units != 0 ? atomicAdd(&args.counters->pass.touch_units, units) : 0u;
    for (uint32_t rest = __ballot_sync(~0u, units != 0); rest != 0; rest &= rest - 1) {
        const int owner = __ffs(int(rest)) - 1;
        const uint32_t list = __shfl_sync(~0u, entry, owner), all = __shfl_sync(~0u, units, owner);
        const uint32_t from = __shfl_sync(~0u, begin, owner), to = __shfl_sync(~0u, end, owner);
        TouchUnit* const listed = args.touch_units + __shfl_sync(~0u, first, owner);
        for (uint32_t i = lane; i < all; i += 32) {
            const uint32_t each = all / args.readers, at = from + i % each * kTouchUnit;
            listed[i] = {list, args.readers > 1 ? i / each : list / args.grid.bins(), i % each, at,
                         min(kTouchUnit, to - at)};
        }
    }
    return first;
}

// The bins by falling size, so that the longest lists are started first, and what the pass needed of the buffers.
__global__ void __launch_bounds__(kThreads) queueKernel(const __grid_constant__ BinCudaArgs args)
{
    __shared__ uint32_t before[kBinClasses], classed;
    constexpr uint32_t kLongClass = 31 - kLongListBits;
    constexpr uint32_t kLongestClass = 31 - kTouchUnitBits - kFirstUnitsBits; // also those of kFirstUnits and no more
    FrameCounters& counters = *args.counters;
    if (threadIdx.x == 0) {
        uint32_t sum = 0;
        for (uint32_t i = 0; i < kBinClasses; ++i) {
            before[i] = sum;
            sum += counters.pass.bin_classes[i];
        }
        classed = sum;
    }
    __syncthreads();
    if (blockIdx.x == 0 && threadIdx.x == 0) {
        unsigned long long pairs = 0;
        uint32_t used = 0;
        for (uint32_t e = 0; e < args.lists; ++e) {
            counters.pairs[e] += counters.pass.pairs[e];
            counters.most_slots = max(counters.most_slots, counters.pass.slots[e]);
            used = max(used, counters.pass.slots[e] - counters.pass.gaps[e]);
            pairs += counters.pass.pairs[e];
        }
        counters.all_slots += used;
        if (pairs > counters.most_pairs)
            counters.most_pairs = pairs;
        if (pairs > args.pair_capacity)
            counters.overflow |= kPairOverflow;
        counters.pass.bins = classed;
        counters.pass.long_bins = before[kLongClass] + counters.pass.bin_classes[kLongClass];
        counters.pass.longest_bins = before[kLongestClass] + counters.pass.bin_classes[kLongestClass];
    }
    const uint32_t bin = blockIdx.x * kThreads + threadIdx.x;
    const bool exists = bin < args.lists * args.grid.bins() && classed != 0; // none in a frame that will be drawn again
    const uint32_t kind = exists ? args.bin_class[bin] : kNotDrawn;
    unsigned long long pairs = 0;
    for (uint32_t e = 0; e < args.lists; ++e)
        pairs += counters.pass.pairs[e];
    uint32_t begin = 0, end = 0;
    if (kind <= kLongClass && pairs <= args.pair_capacity) { // with more it is drawn again
        begin = bin == 0 ? 0u : args.cells[(bin << args.grid.slab_bits) - 1];
        end = args.cells[((bin + 1) << args.grid.slab_bits) - 1];
    }
    const uint32_t first_unit = listUnits(args, bin, begin, end);
    if (kind == kNotDrawn)
        return;
    for (uint32_t reader = 0; reader < args.readers; ++reader)
        args.unfinished[reader * args.lists * args.grid.bins() + bin] = 0;
    args.bin_units[bin] = first_unit;
    args.bin_queue[before[kind] + shareAtomic(counters.pass.queued, kind).mine()] = bin;
}

} // namespace

void slabCuda(const SlabCudaArgs& args, CUstream_st* stream)
{
    launchCuda(slabKernel, kDepthBuckets / kSlabBlock, kSlabBlock, 0, stream, args);
}

size_t binScratchBytes(uint32_t cells)
{
    size_t bytes = 0;
    uint32_t* none = nullptr;
    GSC_CUDA_CHECK(cub::DeviceScan::ExclusiveSum(nullptr, bytes, none, cells));
    return bytes;
}

uint32_t pieceCapacity(uint32_t bins, uint32_t pairs)
{
    return bins + pairs / kPieceAim + 1;
}

uint32_t touchCapacity(uint32_t readers, uint32_t bins, uint32_t pairs)
{
    return readers *
           (pairs / kTouchUnit + std::min(bins, pairs / kLongList)); // the last of a list may be all but empty
}

void binCuda(const BinCudaArgs& args, uint32_t processors, CUstream_st* stream)
{
    const uint32_t cells = args.lists * args.grid.cells();
    size_t bytes = args.scratch_bytes;
    GSC_CUDA_CHECK(cub::DeviceScan::ExclusiveSum(args.scratch, bytes, args.cells, cells, stream));
    launchCuda(scatterKernel, dim3(processors * kScatterBlocks / args.lists, args.lists), kThreads, 0, stream, args);
    launchCuda(scatterWideKernel, 2 * processors, kThreads, 0, stream, args);
    launchCuda(pieceKernel, processors * kBlocksPerProcessor, kThreads, 0, stream, args);
    launchCuda(queueKernel, (args.lists * args.grid.bins() + kThreads - 1) / kThreads, kThreads, 0, stream, args);
}

} // namespace gsc
