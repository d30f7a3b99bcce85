// SPDX-License-Identifier: Apache-2.0
#include "kernels/bin/bin_cuda.h"

#include "kernels/bin/piece.cuh"
#include "kernels/cuda/depth_cells.cuh"
#include "kernels/cuda/launch.cuh"
#include "kernels/cuda/warp_list.cuh"

#include <cub/block/block_scan.cuh>
#include <cub/device/device_scan.cuh>

#include <algorithm>

namespace gsc {

namespace {

constexpr uint32_t kSlabBlock = 512; // threads of a block, each for one bucket of depths
static_assert(kDepthBuckets % (4 * kSlabBlock) == 0);
constexpr uint32_t kThreads = 256;
constexpr uint32_t kScatterBlocks = 6; // blocks per multiprocessor, which leaves 40 registers to a thread
constexpr uint32_t kWideBlocks = 8;
// A splat that touches kManyBins bins or more is not done by the warp that finds it, but dealt to all warps: near
// splats lie in neighbouring slots, so that one warp would have many of them and end last.
constexpr uint32_t kManyBins = 128, kWideParts = 4;

// Share (0..1) of all counts of the histogram that lies before the middle of this thread's bucket; it grows from bucket
// to bucket. Below zero if all counts are 0. Each block adds up the whole histogram by itself: it is small, and no
// block waits for another.
__device__ float middleOf(const uint32_t* histogram)
{
    using Scan = cub::BlockScan<uint32_t, kSlabBlock>;
    __shared__ typename Scan::TempStorage scratch;
    __shared__ uint32_t first, all; // sum of the counts before this block's buckets; sum of all counts
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

// Gives each bucket of depths the slab into which the middle of the bucket falls.
__global__ void __launch_bounds__(kSlabBlock) slabKernel(const __grid_constant__ SlabCudaArgs args)
{
    const uint32_t slab = uint32_t(fmaxf(middleOf(args.histogram), 0.0f) * float(args.slabs));
    args.slab_of[blockIdx.x * kSlabBlock + threadIdx.x] = uint16_t(min(slab, args.slabs - 1));
}

__global__ void __launch_bounds__(kThreads, kScatterBlocks) scatterKernel(const __grid_constant__ BinCudaArgs args)
{
    if (willRepeat(*args.counters))
        return;
    const uint32_t e = blockIdx.y, count = min(args.counters->pass.slots[e], args.slot_capacity);
    const uint32_t base = e * args.slot_capacity;
    uint32_t* cells = args.cells + size_t(e) * args.grid.cells();
    // all lanes of a warp stay in the loop, since they work together
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

// A block takes part of the bins of a splat that scatterKernel() left out. There are no such splats in a frame that
// will be drawn again.
__global__ void __launch_bounds__(kThreads) scatterWideKernel(const __grid_constant__ BinCudaArgs args)
{
    const uint32_t parts = min(args.counters->pass.wide, kWideSplats) * kWideParts;
    for (uint32_t part = blockIdx.x; part < parts; part += gridDim.x) {
        const uint32_t slot = args.wide[part / kWideParts];
        const SplatPlace place = args.places[slot];
        const uint32_t x0 = place.box & 255u, y0 = place.box >> 8 & 255u, width = (place.box >> 16 & 255u) - x0 + 1;
        uint32_t* cells = args.cells + size_t(slot / args.slot_capacity) * args.grid.cells() +
                          (args.pass.slab_of[depthBucket(place.depth_bits)] & (args.grid.slabs() - 1));
        const uint32_t bins = binCount(place.box);
        // atomic operations that a thread has under way at once
        constexpr uint32_t kAtOnce = 4, kStep = kWideParts * kThreads;
        for (uint32_t first = part % kWideParts * kThreads + threadIdx.x; first < bins; first += kAtOnce * kStep) {
            uint32_t at[kAtOnce];
#pragma unroll
            for (uint32_t j = 0; j < kAtOnce; ++j) {
                const uint32_t i = first + j * kStep, bin = (y0 + i / width) * args.grid.columns + x0 + i % width;
                at[j] = i < bins ? atomicAdd(cells + (bin << args.grid.slab_bits), 1u) : ~0u;
            }
#pragma unroll
            for (uint32_t j = 0; j < kAtOnce; ++j)
                if (at[j] < args.pair_capacity)
                    args.keys[at[j]] = {place.depth_bits, slot};
        }
    }
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
           // counts a unit more for each list, the last of which may be nearly empty
           (pairs / kTouchUnit + std::min(bins, pairs / kLongList));
}

void binCuda(const BinCudaArgs& args, uint32_t processors, CUstream_st* stream)
{
    const uint32_t cells = args.lists * args.grid.cells();
    size_t bytes = args.scratch_bytes;
    GSC_CUDA_CHECK(cub::DeviceScan::ExclusiveSum(args.scratch, bytes, args.cells, cells, stream));
    launchCuda(scatterKernel, dim3(processors * kScatterBlocks / args.lists, args.lists), kThreads, 0, stream, args);
    launchCuda(scatterWideKernel, kWideBlocks * processors, kThreads, 0, stream, args);
    const uint32_t bins = args.lists * args.grid.bins();
    launchCuda(pieceKernel, (bins + kPieceWarps - 1) / kPieceWarps, kPieceWarps * 32,
               kPieceWarps * args.grid.slabs() * sizeof(uint32_t), stream, args);
    launchCuda(queueKernel, (bins + kQueueThreads - 1) / kQueueThreads + 1, kQueueThreads, 0, stream, args);
}

} // namespace gsc
