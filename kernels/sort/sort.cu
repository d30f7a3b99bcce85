// SPDX-License-Identifier: Apache-2.0
#include "kernels/sort/sort_cuda.h"

#include "kernels/cuda/launch.cuh"
#include "kernels/decode/decode_cuda.h"
#include "kernels/sort/bitonic.cuh"

namespace gsc {

namespace {

constexpr uint32_t kThreads = 512;
constexpr uint32_t kWarps = kThreads / 32;
constexpr uint32_t kBlocksPerProcessor = 2;
constexpr uint32_t kItems = 16;      // largest number of keys per thread
constexpr uint32_t kLongestRun = 32; // longest run of equal keys that one thread puts in order

static_assert(kWarpPiece == 32 * kItems && kWarpPiece << (kPieceClasses - 2) == kThreads * kItems);

// Place in shared memory of item `e` of a sorted piece. After every 16 items a word is left out, so that neither 16
// items in a row nor every 16th item fall into one memory bank.
__device__ __forceinline__ constexpr uint32_t padded(uint32_t e)
{
    return e + e / 16;
}

struct SortShared {
    uint32_t sorted[padded(kThreads * kItems)]; // keys with their places; also used by the sorting network
    uint32_t slots[kThreads * kItems];
    uint32_t ties[kThreads * kItems / 32]; // bit e is set if keys e and e + 1 are equal
    uint32_t low[kWarps], high[kWarps];
    uint32_t next[kWarps];
};

static_assert(sizeof(SortShared) <= 99 * 1024); // a block can have no more on compute capability 8.6, 8.9 and 12.0

// Part of the shared memory of a block that one team uses.
struct TeamMemory {
    uint32_t *sorted, *slots, *ties, *low, *high;
};

template <uint32_t kStride>
struct Nearer {
    const uint32_t* orders; // emission orders of the splats by slot

    __device__ __forceinline__ bool operator()(const SortKey& a, const SortKey& b) const
    {
        if (a.depth_bits != b.depth_bits)
            return a.depth_bits < b.depth_bits;
        return orders[size_t(a.slot) * kStride] < orders[size_t(b.slot) * kStride];
    }
};

// Sorts `count` keys in any memory, of which every `sorted` keys in a row are sorted already, with a bitonic network.
// Its merges begin with the second half mirrored, so that keys beyond the end need not exist. Used for pieces that do
// not fit registers, or whose ties are too long.
template <typename Order, typename Team>
__device__ __attribute__((noinline)) void sortInMemory(SortKey* keys, uint32_t count, uint32_t sorted,
                                                       const Order& nearer, const Team& team)
{
    const auto exchange = [&](uint32_t i, uint32_t j) {
        if (j >= count)
            return;
        const SortKey a = keys[i], b = keys[j];
        if (nearer(b, a)) {
            keys[i] = b;
            keys[j] = a;
        }
    };
    team.sync();
    for (uint32_t half_size = sorted; half_size < count && half_size != 0; half_size *= 2) {
        const uint32_t pairs = (count - 1) / (2 * half_size) * half_size + half_size;
        for (uint32_t t = team.thread; t < pairs; t += team.threads) {
            const uint32_t block = t / half_size * (2 * half_size), in = t % half_size;
            exchange(block + in, block + 2 * half_size - 1 - in);
        }
        team.sync();
        for (uint32_t d = half_size / 2; d > 0; d /= 2) {
            for (uint32_t t = team.thread; t < pairs; t += team.threads) {
                const uint32_t i = t / d * (2 * d) + t % d;
                exchange(i, i + d);
            }
            team.sync();
        }
    }
}

// Finds the smallest and the largest value of all threads of a team.
template <typename Team>
__device__ __forceinline__ void extremes(uint32_t& low, uint32_t& high, const TeamMemory& memory, const Team& team)
{
    low = __reduce_min_sync(~0u, low);
    high = __reduce_max_sync(~0u, high);
    if constexpr (!Team::kOneWarp) {
        const uint32_t lane = team.thread & 31u, warps = team.threads / 32;
        if (lane == 0) {
            memory.low[team.thread / 32] = low;
            memory.high[team.thread / 32] = high;
        }
        team.sync();
        low = __reduce_min_sync(~0u, memory.low[lane & (warps - 1)]);
        high = __reduce_max_sync(~0u, memory.high[lane & (warps - 1)]);
    }
}

// Puts keys whose sorted bits are equal in the order of all bits of their depth, and of emission. The thread that has
// the first key of a run of equal keys does so for the run. all_bits: the sorted bits are all bits of the depth.
// Returns false if a run is longer than kLongestRun.
template <uint32_t kItemCount, typename Order, typename Team>
__device__ __forceinline__ bool orderTies(const SortKey* keys, uint32_t count, uint32_t index_bits, bool all_bits,
                                          const Order& nearer, const TeamMemory& memory, const Team& team)
{
    const uint32_t lane = team.thread & 31u;
    bool some = false;
#pragma unroll
    for (uint32_t i = 0; i < kItemCount; ++i) {
        const uint32_t e = i * team.threads + team.thread;
        const bool tied =
            e + 1 < count && memory.sorted[padded(e)] >> index_bits == memory.sorted[padded(e + 1)] >> index_bits;
        const uint32_t word = __ballot_sync(~0u, tied);
        some |= word != 0;
        if (lane == 0)
            memory.ties[e / 32] = word;
    }
    if (!team.any(some))
        return true;
    const uint32_t index_mask = (1u << index_bits) - 1u;
    const auto tied = [&](uint32_t e) { return (memory.ties[e / 32] >> (e & 31u) & 1u) != 0; };
    const auto keyOf = [&](uint32_t item) { // if depths are equal only the slot, which is in shared memory, is needed
        const uint32_t at = item & index_mask;
        return all_bits ? SortKey{0, memory.slots[at]} : keys[at];
    };
    bool too_long = false;
    for (uint32_t w = team.thread; w < kItemCount * team.threads / 32; w += team.threads) {
        const uint32_t word = memory.ties[w], before = w != 0 ? memory.ties[w - 1] >> 31 : 0u;
        for (uint32_t starts = word & ~(word << 1 | before); starts != 0; starts &= starts - 1) {
            const uint32_t e = 32 * w + uint32_t(__ffs(int(starts))) - 1;
            uint32_t end = e + 2; // never beyond the piece, since its last key has no bit in `ties`
            while (tied(end - 1) && end - e <= kLongestRun)
                ++end;
            if (end - e > kLongestRun) {
                too_long = true;
                continue;
            }
            for (uint32_t i = e + 1; i < end; ++i) {
                const uint32_t moving = memory.sorted[padded(i)];
                const SortKey key = keyOf(moving);
                uint32_t to = i;
                for (; to > e; --to) {
                    const uint32_t before_it = memory.sorted[padded(to - 1)];
                    if (!nearer(key, keyOf(before_it)))
                        break;
                    memory.sorted[padded(to)] = before_it;
                }
                memory.sorted[padded(to)] = moving;
            }
        }
    }
    return !team.any(too_long);
}

// Sorts a piece of up to kItemCount keys per thread. It sorts words of a key's place in the piece and as many bits of
// the depth, counted from the nearest key's, as fit above it. kWhole: moves whole keys, not only their slots.
template <uint32_t kItemCount, bool kWhole, typename Order, typename Team>
__device__ void sortPiece(SortKey* keys, uint32_t count, const Order& nearer, const TeamMemory& memory,
                          const Team& team)
{
    const uint32_t index_bits = uint32_t(31 - __clz(int(team.threads * kItemCount)));
    uint32_t values[kItemCount], low = ~0u, high = 0;
    team.sync(); // waits before the memory is written
#pragma unroll
    for (uint32_t i = 0; i < kItemCount; ++i) {
        const uint32_t at = i * team.threads + team.thread;
        const SortKey key = at < count ? keys[at] : SortKey{~0u, 0};
        values[i] = key.depth_bits;
        memory.slots[at] = key.slot;
        if (at < count) {
            low = min(low, key.depth_bits);
            high = max(high, key.depth_bits);
        }
    }
    extremes(low, high, memory, team);
    const uint32_t used = 32u - uint32_t(__clz(int(high - low)));
    const uint32_t shift = used > 32 - index_bits ? used - (32 - index_bits) : 0u;
#pragma unroll
    for (uint32_t i = 0; i < kItemCount; ++i) {
        const uint32_t at = i * team.threads + team.thread;
        // ~0u fills up and is sorted to the end
        values[i] = at < count ? (values[i] - low) >> shift << index_bits | at : ~0u;
    }
    sortInRegisters(values, memory.sorted, team);
    team.sync();
#pragma unroll
    for (uint32_t i = 0; i < kItemCount; ++i)
        memory.sorted[padded(team.thread * kItemCount + i)] = values[i];
    team.sync();
    if (!orderTies<kItemCount>(keys, count, index_bits, shift == 0, nearer, memory, team)) {
        sortInMemory(keys, count, 1, nearer, team);
        return;
    }
    const uint32_t index_mask = (1u << index_bits) - 1u;
    if constexpr (kWhole) {
        SortKey moved[kItemCount];
#pragma unroll
        for (uint32_t i = 0; i < kItemCount; ++i) {
            const uint32_t e = i * team.threads + team.thread;
            if (e < count)
                moved[i] = keys[memory.sorted[padded(e)] & index_mask];
        }
        team.sync();
#pragma unroll
        for (uint32_t i = 0; i < kItemCount; ++i)
            if (i * team.threads + team.thread < count)
                keys[i * team.threads + team.thread] = moved[i];
    } else {
#pragma unroll
        for (uint32_t i = 0; i < kItemCount; ++i) {
            const uint32_t e = i * team.threads + team.thread;
            if (e < count)
                // the whole key is written, since half of it would cost as much
                keys[e] = {0u, memory.slots[memory.sorted[padded(e)] & index_mask]};
        }
    }
}

// Sorts a piece that is too long for a block: first its parts, then the parts together. It is rare, and a function of
// its own so that its registers do not count for other pieces.
template <typename Order>
__device__ __attribute__((noinline)) void sortLong(SortKey* keys, const Piece& piece, const Order& nearer,
                                                   const TeamMemory& memory, const SortTeam& block)
{
    constexpr uint32_t kPart = kThreads * kItems;
    for (uint32_t first = 0; first < piece.count; first += kPart)
        sortPiece<kItems, true>(keys + piece.first + first, min(kPart, piece.count - first), nearer, memory, block);
    sortInMemory(keys + piece.first, piece.count, kPart, nearer, block);
}

// Takes the next piece for a team and returns its number, to all threads. All threads of the team call it together.
template <typename Team>
__device__ __forceinline__ uint32_t takePiece(uint32_t* queue, uint32_t* shared, const Team& team)
{
    if (team.thread == 0)
        *shared = atomicAdd(queue, 1u);
    team.sync();
    const uint32_t i = *shared;
    team.sync();
    return i;
}

// Sorts all pieces: the longest first, by whole blocks, then those for teams of some warps, then those for one warp.
template <uint32_t kStride>
__global__ void __launch_bounds__(kThreads, kBlocksPerProcessor) sortKernel(const __grid_constant__ SortCudaArgs args)
{
    if (willRepeat(*args.counters))
        return;
    GSC_DYNAMIC_SHARED(bytes);
    SortShared& shared = *reinterpret_cast<SortShared*>(bytes);
    const Nearer<kStride> nearer{args.orders};
    const uint32_t warp = threadIdx.x / 32, lane = threadIdx.x & 31u;
    PassCounters& counters = args.counters->pass;
    const auto pieces = [&](uint32_t kind) { return args.pieces + size_t(kind) * args.piece_capacity; };
    const auto memoryFrom = [&](uint32_t first_warp) {
        constexpr uint32_t kKeys = 32 * kItems; // keys that a warp sorts at once
        return TeamMemory{shared.sorted + first_warp * padded(kKeys), shared.slots + first_warp * kKeys,
                          shared.ties + first_warp * kItems, shared.low + first_warp, shared.high + first_warp};
    };

    constexpr uint32_t kLongest = kPieceClasses - 1;
    const uint32_t longest = counters.pieces[kLongest];
    const SortTeam block{kThreads, threadIdx.x, 0};
    for (uint32_t i; (i = takePiece(&counters.next_piece[kLongest], shared.next, block)) < longest;)
        sortLong(args.keys, pieces(kLongest)[i], nearer, memoryFrom(0), block);
#pragma unroll 1
    for (uint32_t kind = kLongest - 1; kind > 0; --kind) {
        const uint32_t warps = 1u << kind, first_warp = warp & ~(warps - 1u);
        // barriers are numbered by the first warp of a team, so that teams of two sizes never meet at one
        const SortTeam team{32 * warps, threadIdx.x - 32 * first_warp, first_warp};
        const TeamMemory part = memoryFrom(first_warp);
        const uint32_t count = counters.pieces[kind];
        for (uint32_t i; (i = takePiece(&counters.next_piece[kind], shared.next + first_warp, team)) < count;) {
            const Piece piece = pieces(kind)[i];
            sortPiece<kItems, false>(args.keys + piece.first, piece.count, nearer, part, team);
        }
    }

    const SortWarp one{lane};
    const TeamMemory own = memoryFrom(warp);
    const uint32_t for_one = counters.pieces[0];
    // the number of the next piece is fetched before a piece is sorted
    const auto take = [&] { return lane == 0 ? atomicAdd(&counters.next_piece[0], 1u) : 0u; };
    for (uint32_t i, next = take(); (i = __shfl_sync(~0u, next, 0)) < for_one;) {
        const Piece piece = pieces(0)[i];
        next = take();
        if (piece.count <= 128)
            sortPiece<4, false>(args.keys + piece.first, piece.count, nearer, own, one);
        else
            sortPiece<kItems, false>(args.keys + piece.first, piece.count, nearer, own, one);
    }
}

} // namespace

void sortCuda(const SortCudaArgs& args, uint32_t processors, CUstream_st* stream)
{
    constexpr uint32_t kPacked = sizeof(PackedSplat) / sizeof(uint32_t), kExact = sizeof(ExactSplat) / sizeof(uint32_t);
    launchCuda(args.exact ? sortKernel<kExact> : sortKernel<kPacked>, processors * kBlocksPerProcessor, kThreads,
               sizeof(SortShared), stream, args);
}

} // namespace gsc
