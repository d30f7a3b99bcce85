// SPDX-License-Identifier: Apache-2.0
#include "kernels/sort/sort_cuda.h"

#include "kernels/common/launch.cuh"

#include <cub/block/block_radix_sort.cuh>
#include <cub/warp/warp_merge_sort.cuh>

namespace gsc {

namespace {

constexpr uint32_t kWarpThreads = 128; // of the kernel whose warps sort a piece each
constexpr uint32_t kWarpItems = 8;     // keys per lane there, and per thread where a block sorts
constexpr int kDigitBits = 5, kDigits = 4;

using WarpSort = cub::WarpMergeSort<unsigned long long, kWarpItems, 32>;

template <uint32_t kThreads>
using BlockSort = cub::BlockRadixSort<uint32_t, kThreads, kWarpItems, uint32_t, kDigitBits>;

template <uint32_t kThreads>
union BlockShared {
    typename BlockSort<kThreads>::TempStorage sort;
    BinKey sorted[kThreads * kWarpItems];
};

__device__ __forceinline__ unsigned long long emissionOrder(const PackedSplat& splat)
{
    return splat.order;
}
__device__ __forceinline__ unsigned long long emissionOrder(const ExactSplat& splat)
{
    return (unsigned long long)splat.order_high << 32 | splat.order_low;
}

// depth << 32 | slot
template <typename Splat>
struct Nearer {
    const Splat* splats;

    __device__ __forceinline__ bool operator()(unsigned long long a, unsigned long long b) const
    {
        if (uint32_t(a >> 32) != uint32_t(b >> 32))
            return a < b;
        // the fill of a short piece has no splat; its depth is above all others
        return uint32_t(a >> 32) != ~0u && emissionOrder(splats[uint32_t(a)]) < emissionOrder(splats[uint32_t(b)]);
    }
};

__device__ __forceinline__ unsigned long long joined(const BinKey& key)
{
    return (unsigned long long)key.depth_bits << 32 | key.slot;
}

template <typename Splat>
__global__ void __launch_bounds__(kWarpThreads) sortByWarpKernel(const __grid_constant__ SortCudaArgs args)
{
    __shared__ typename WarpSort::TempStorage scratch[kWarpThreads / 32];
    const uint32_t lane = threadIdx.x & 31u, warps = gridDim.x * kWarpThreads / 32;
    const uint32_t count = args.counters->pass.pieces[0];
    for (uint32_t p = (blockIdx.x * kWarpThreads + threadIdx.x) / 32; p < count; p += warps) {
        const Piece piece = args.pieces[p];
        unsigned long long keys[kWarpItems];
#pragma unroll
        for (uint32_t i = 0; i < kWarpItems; ++i) {
            const uint32_t at = i * 32 + lane;
            keys[i] = at < piece.count ? joined(args.keys[piece.first + at]) : ~0ull;
        }
        WarpSort(scratch[threadIdx.x >> 5]).Sort(keys, Nearer<Splat>{static_cast<const Splat*>(args.splats)});
#pragma unroll
        for (uint32_t i = 0; i < kWarpItems; ++i) {
            const uint32_t at = lane * kWarpItems + i;
            if (at < piece.count)
                args.keys[piece.first + at].slot = uint32_t(keys[i]);
        }
        __syncwarp(); // the scratch is used again
    }
}

// Bits in which the depths of a piece differ: those above are all the same.
template <uint32_t kThreads>
__device__ uint32_t differingBits(const uint32_t* keys, uint32_t count)
{
    __shared__ uint32_t low, high;
    if (threadIdx.x == 0) {
        low = ~0u;
        high = 0;
    }
    __syncthreads();
    uint32_t l = ~0u, h = 0;
#pragma unroll
    for (uint32_t i = 0; i < kWarpItems; ++i)
        if (i * kThreads + threadIdx.x < count) {
            l = min(l, keys[i]);
            h = max(h, keys[i]);
        }
    l = __reduce_min_sync(~0u, l);
    h = __reduce_max_sync(~0u, h);
    if ((threadIdx.x & 31u) == 0) {
        atomicMin(&low, l);
        atomicMax(&high, h);
    }
    __syncthreads();
    return 32u - uint32_t(__clz(int(low ^ high)));
}

// A bitonic network over `count` keys in any memory, whose first step of every merge is a flip, so that keys beyond the
// end need not exist. For what the radix sort cannot order: many splats at one depth in one bin.
template <uint32_t kThreads, typename Splat>
__device__ void sortByNetwork(BinKey* keys, uint32_t count, const Nearer<Splat>& nearer)
{
    const auto exchange = [&](uint32_t i, uint32_t j) {
        if (j >= count)
            return;
        const BinKey a = keys[i], b = keys[j];
        if (nearer(joined(b), joined(a))) {
            keys[i] = b;
            keys[j] = a;
        }
    };
    for (uint32_t half_size = 1; half_size < count && half_size != 0; half_size *= 2) {
        const uint32_t pairs = (count - 1) / (2 * half_size) * half_size + half_size;
        for (uint32_t t = threadIdx.x; t < pairs; t += kThreads) {
            const uint32_t block = t / half_size * (2 * half_size), in = t % half_size;
            exchange(block + in, block + 2 * half_size - 1 - in);
        }
        __syncthreads();
        for (uint32_t d = half_size / 2; d > 0; d /= 2) {
            for (uint32_t t = threadIdx.x; t < pairs; t += kThreads) {
                const uint32_t i = t / d * (2 * d) + t % d;
                exchange(i, i + d);
            }
            __syncthreads();
        }
    }
}

// Sorts by the highest bits that differ, which leaves few neighbours to exchange.
template <uint32_t kThreads, typename Splat>
__device__ void sortByBlock(const SortCudaArgs& args, BlockShared<kThreads>& shared, const Piece& piece)
{
    const Nearer<Splat> nearer{static_cast<const Splat*>(args.splats)};
    uint32_t depths[kWarpItems], slots[kWarpItems], keys[kWarpItems];
#pragma unroll
    for (uint32_t i = 0; i < kWarpItems; ++i) {
        const uint32_t at = i * kThreads + threadIdx.x;
        const BinKey key = at < piece.count ? args.keys[piece.first + at] : BinKey{~0u, 0};
        depths[i] = key.depth_bits;
        slots[i] = key.slot;
    }
    const uint32_t differing = differingBits<kThreads>(depths, piece.count);
    // one value above all others is left for the fill
    constexpr uint32_t kBits = kDigitBits * kDigits - 1;
    const uint32_t shift = differing > kBits ? differing - kBits : 0u, bits = differing - shift + 1;
    const uint32_t fill = (1u << bits) - 1u;
#pragma unroll
    for (uint32_t i = 0; i < kWarpItems; ++i) {
        const uint32_t at = i * kThreads + threadIdx.x;
        keys[i] = at < piece.count ? depths[i] >> shift & fill >> 1 : fill;
        slots[i] = at; // where the key is
    }
    BlockSort<kThreads>(shared.sort).SortBlockedToStriped(keys, slots, 0, int(bits));
    __syncthreads();
    BinKey* sorted = shared.sorted;
#pragma unroll
    for (uint32_t i = 0; i < kWarpItems; ++i)
        if (i * kThreads + threadIdx.x < piece.count)
            sorted[i * kThreads + threadIdx.x] = args.keys[piece.first + slots[i]];
    __syncthreads();
    constexpr uint32_t kRounds = 16; // after which the runs of equal keys are longer than neighbours can repair
    bool moved = true;
    uint32_t rounds = 0;
    while (__syncthreads_or(moved) && rounds++ < kRounds) {
        moved = false;
        for (uint32_t parity = 0; parity < 2; ++parity) {
            for (uint32_t i = 2 * threadIdx.x + parity; i + 1 < piece.count; i += 2 * kThreads) {
                const BinKey a = sorted[i], b = sorted[i + 1];
                if (b.depth_bits <= a.depth_bits && nearer(joined(b), joined(a))) {
                    sorted[i] = b;
                    sorted[i + 1] = a;
                    moved = true;
                }
            }
            __syncthreads();
        }
    }
    if (rounds > kRounds)
        sortByNetwork<kThreads>(sorted, piece.count, nearer);
    for (uint32_t i = threadIdx.x; i < piece.count; i += kThreads)
        args.keys[piece.first + i] = sorted[i];
    __syncthreads();
}

// The pieces of one class; kLong: also those that no block can hold.
template <uint32_t kThreads, uint32_t kClass, bool kLong, typename Splat>
__global__ void __launch_bounds__(kThreads, 1024 / kThreads)
    sortByBlockKernel(const __grid_constant__ SortCudaArgs args)
{
    GSC_DYNAMIC_SHARED(memory);
    BlockShared<kThreads>& shared = *reinterpret_cast<BlockShared<kThreads>*>(memory);
    __shared__ uint32_t next;
    for (uint32_t kind = kLong ? kClass + 1 : kClass; kind >= kClass; --kind) {
        const uint32_t count = args.counters->pass.pieces[kind];
        const Piece* pieces = args.pieces + size_t(kind) * args.piece_capacity;
        while (true) {
            if (threadIdx.x == 0)
                next = atomicAdd(&args.counters->pass.next_piece[kind], 1u);
            __syncthreads();
            const uint32_t i = next;
            __syncthreads();
            if (i >= count)
                break;
            if (kind == kClass)
                sortByBlock<kThreads, Splat>(args, shared, pieces[i]);
            else
                sortByNetwork<kThreads>(args.keys + pieces[i].first, pieces[i].count,
                                        Nearer<Splat>{static_cast<const Splat*>(args.splats)});
        }
    }
}

template <uint32_t kThreads, uint32_t kClass, bool kLong, typename Splat>
void launchClass(const SortCudaArgs& args, uint32_t processors, CUstream_st* stream)
{
    launchCuda(sortByBlockKernel<kThreads, kClass, kLong, Splat>, processors * (1024 / kThreads), kThreads,
               sizeof(BlockShared<kThreads>), stream, args);
}

template <typename Splat>
void prepare()
{
    raiseSharedLimit(sortByBlockKernel<128, 1, false, Splat>, sizeof(BlockShared<128>));
    raiseSharedLimit(sortByBlockKernel<256, 2, false, Splat>, sizeof(BlockShared<256>));
    raiseSharedLimit(sortByBlockKernel<512, 3, true, Splat>, sizeof(BlockShared<512>));
}

template <typename Splat>
void launch(const SortCudaArgs& args, uint32_t processors, CUstream_st* stream)
{
    launchClass<512, 3, true, Splat>(args, processors, stream);
    launchClass<256, 2, false, Splat>(args, processors, stream);
    launchClass<128, 1, false, Splat>(args, processors, stream);
    launchCuda(sortByWarpKernel<Splat>, processors * 8, kWarpThreads, 0, stream, args);
}

} // namespace

void prepareSortCuda()
{
    prepare<PackedSplat>();
    prepare<ExactSplat>();
}

void sortFastCuda(const SortCudaArgs& args, uint32_t processors, CUstream_st* stream)
{
    launch<PackedSplat>(args, processors, stream);
}

void sortExactCuda(const SortCudaArgs& args, uint32_t processors, CUstream_st* stream)
{
    launch<ExactSplat>(args, processors, stream);
}

} // namespace gsc
