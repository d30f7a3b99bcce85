// SPDX-License-Identifier: Apache-2.0
#include "kernels/blend/blend_cuda.h"

#include "kernels/blend/blend_rules.cuh"
#include "kernels/common/launch.cuh"
#include "kernels/common/ptx.cuh"

namespace gsc {

namespace {

constexpr uint32_t kThreads = 512;
constexpr uint32_t kGroup = 128; // threads that blend a bin together, unless it is hot: then it takes the whole block
constexpr uint32_t kGroups = kThreads / kGroup;
constexpr uint32_t kBlocksPerProcessor = 2;
static_assert(kBinWidth == 32);

// Some threads of a block that synchronise among themselves.
struct Team {
    uint32_t barrier, threads, thread;

    __device__ __forceinline__ void sync() const { barrierSync(barrier, threads); }
    __device__ __forceinline__ bool any(bool value) const { return barrierAny(barrier, threads, value); }
};

// Blends `m` splats of shared memory, front to back, into the tile of this warp; the one after the team's last draws
// nothing. First the splats of every sub-tile are listed, then each list is blended: a warp that tests and one that
// blends both keep all lanes busy. `lists`: this warp's, one entry per sub-tile and thread of the team. Returns the
// sub-tiles still open.
template <typename Rules, typename T>
__device__ __forceinline__ uint32_t blendBatch(const typename Rules::Lit* splats, uint32_t m, uint32_t threads,
                                               uint16_t* lists, const BlendCudaArgs& args, uint32_t x0, uint32_t y0,
                                               uint32_t open, T& tile, uint32_t& evaluations)
{
    using Lit = typename Rules::Lit;
    constexpr bool kOne = T::kRows * T::kColumns == 1;
    if (open == 0)
        return 0;
    const uint32_t lane = threadIdx.x & 31u;
    float first = 0.0f, last = float(T::kHeight * T::kRows - 1);
    if constexpr (kOne) { // what is finished shrinks the tile
        const uint32_t pixels = __ballot_sync(~0u, tile.transmittance[0][0] > 0.0f);
        first = float((__ffs(int(pixels)) - 1) / int(T::kWidth));
        last = float((31 - __clz(int(pixels))) / int(T::kWidth));
    }
    uint32_t counts[T::kRows * T::kColumns] = {};
    for (uint32_t start = 0; start < m; start += 32) {
        uint32_t mask = 0;
        if (start + lane < m) {
            const Lit& s = splats[start + lane];
            if (Rules::coversTile(s, x0 / kTileSize, y0 / kTileSize))
                mask = subTileMask<T>(s.bounds, centerX(s) - float(x0), centerY(s) - float(y0), first, last) & open;
        }
#pragma unroll
        for (uint32_t t = 0; t < T::kRows * T::kColumns; ++t) {
            const bool hit = (mask >> t & 1u) != 0;
            const uint32_t hits = __ballot_sync(~0u, hit);
            if (hit)
                lists[t * threads + counts[t] + __popc(hits & ((1u << lane) - 1u))] =
                    uint16_t((start + lane) * sizeof(Lit));
            counts[t] += __popc(hits);
        }
    }
#pragma unroll
    for (uint32_t t = 0; t < T::kRows * T::kColumns; ++t)
        if (lane < ((0u - counts[t]) & 3u)) // whole fours; a list of all the team's splats is one already
            lists[t * threads + counts[t] + lane] = uint16_t(threads * sizeof(Lit));
    __syncwarp();
#pragma unroll
    for (uint32_t row = 0; row < T::kRows; ++row)
#pragma unroll
        for (uint32_t column = 0; column < T::kColumns; ++column) {
            const uint32_t t = row * T::kColumns + column, count = counts[t];
            if (count == 0)
                continue;
            float& transmittance = tile.transmittance[row][column];
            const float px = float(x0 + lane % T::kWidth + T::kWidth * column);
            const float py = float(y0 + lane / T::kWidth + T::kHeight * row);
            const uint2* four = reinterpret_cast<const uint2*>(lists + t * threads);
            for (uint32_t i = 0; i < count; i += 4) {
                const uint2 offsets = four[i / 4];
                const char* base = reinterpret_cast<const char*>(splats);
                const Lit* const chosen[4] = {reinterpret_cast<const Lit*>(base + (offsets.x & 0xffffu)),
                                              reinterpret_cast<const Lit*>(base + (offsets.x >> 16)),
                                              reinterpret_cast<const Lit*>(base + (offsets.y & 0xffffu)),
                                              reinterpret_cast<const Lit*>(base + (offsets.y >> 16))};
                Rules::blend(chosen, args, px, py, transmittance, tile.color[row][column]);
            }
            evaluations += count;
            if (!__any_sync(~0u, transmittance > 0.0f))
                open &= ~(1u << t);
        }
    __syncwarp(); // the lists are written again
    return open;
}

// Blends one bin; (x0, y0) is this warp's tile. `batch`: room for one splat per thread of the team and one more.
template <typename Rules, typename T>
__device__ __forceinline__ void blendBin(const BlendCudaArgs& args, const Team& team, typename Rules::Lit* batch,
                                         uint16_t* lists, uint32_t entry, uint32_t x0, uint32_t y0,
                                         uint32_t& evaluations)
{
    using Splat = typename Rules::Splat;
    const Splat* all = static_cast<const Splat*>(args.splats);
    const uint32_t lane = threadIdx.x & 31u;
    const uint32_t e = entry >= args.grid.bins() ? 1u : 0u;
    const uint32_t begin = entry == 0 ? 0u : min(args.cells[(entry << args.grid.slab_bits) - 1], args.pair_capacity);
    uint32_t end = min(args.cells[((entry + 1) << args.grid.slab_bits) - 1], args.pair_capacity);
    const uint32_t width = e == 0 ? args.width[0] : args.width[1], height = e == 0 ? args.height[0] : args.height[1];

    float* image = e == 0 ? args.image[0] : args.image[1];
    float* left_over = e == 0 ? args.transmittance[0] : args.transmittance[1];

    T tile;
    uint32_t open = 0;
#pragma unroll
    for (uint32_t row = 0; row < T::kRows; ++row)
#pragma unroll
        for (uint32_t column = 0; column < T::kColumns; ++column) {
            const uint32_t x = x0 + lane % T::kWidth + T::kWidth * column;
            const uint32_t y = y0 + lane / T::kWidth + T::kHeight * row;
            float transmittance = x < width && y < height ? 1.0f : -1.0f;
            for (int i = 0; i < 3; ++i)
                tile.color[row][column][i] = 0.0f;
            if (args.pass.index != 0 && transmittance > 0.0f) {
                transmittance = left_over[size_t(y) * width + x];
                for (int i = 0; i < 3; ++i)
                    tile.color[row][column][i] = image[(size_t(y) * width + x) * 3 + i];
            }
            tile.transmittance[row][column] = transmittance;
            open |= __any_sync(~0u, transmittance > 0.0f) ? 1u << (row * T::kColumns + column) : 0u;
        }
    if (args.pass.index != 0 && !team.any(open != 0))
        end = begin; // nearer passes have finished it

    // the splat of the next batch is on its way while this one is blended, and the slot of the one after it
    uint32_t at = begin + team.thread;
    const auto slotAt = [&](uint32_t i) { return i < end ? args.keys[i].slot : 0u; };
    const auto fetch = [&](uint32_t i, uint32_t slot) {
        Splat s;
        if (i < end)
#pragma unroll
            for (uint32_t part = 0; part < sizeof(Splat) / 16; ++part)
                reinterpret_cast<uint4*>(&s)[part] = reinterpret_cast<const uint4*>(all + slot)[part];
        return s;
    };
    Splat splat = fetch(at, slotAt(at));
    uint32_t slot = slotAt(at + team.threads);
    for (uint32_t first = begin; first < end; first += team.threads) {
        if (at < end)
            batch[team.thread] = Rules::light(splat);
        at += team.threads;
        splat = fetch(at, slot);
        slot = slotAt(at + team.threads);
        team.sync();
        open = blendBatch<Rules>(batch, min(team.threads, end - first), team.threads, lists, args, x0, y0, open, tile,
                                 evaluations);
        if (!team.any(open != 0))
            break;
    }

    const bool last = args.pass.index + 1 == args.pass.count;
    const bool black = last && args.empty_is_black && args.counters->any_positive[e] == 0;
#pragma unroll
    for (uint32_t row = 0; row < T::kRows; ++row)
#pragma unroll
        for (uint32_t column = 0; column < T::kColumns; ++column) {
            const uint32_t x = x0 + lane % T::kWidth + T::kWidth * column;
            const uint32_t y = y0 + lane / T::kWidth + T::kHeight * row;
            if (x >= width || y >= height)
                continue;
            const float transmittance = tile.transmittance[row][column];
            float* pixel = image + (size_t(y) * width + x) * 3;
            for (int i = 0; i < 3; ++i) {
                const float color = tile.color[row][column][i];
                pixel[i] = !last ? color : black ? 0.0f : fmaf(fabsf(transmittance), args.background[i], color);
            }
            if (!last)
                left_over[size_t(y) * width + x] = transmittance;
        }
}

template <typename Rules, uint32_t kRows>
struct BlendShared {
    static_assert(kThreads * sizeof(typename Rules::Lit) < 1u << 16); // an offset of a list

    typename Rules::Lit batches[kGroups * (kGroup + 1)]; // one of all threads in a hot bin
    // per warp: sub-tiles x splats of a batch, of a group or of the whole block
    alignas(8) uint16_t lists[kThreads / 32][kRows * 2 * kGroup];
    uint32_t next[kGroups];
};

// kRows: rows of sub-tiles of a warp that shares its bin with three others.
template <typename Rules, uint32_t kRows>
__global__ void __launch_bounds__(kThreads, kBlocksPerProcessor) blendKernel(const __grid_constant__ BlendCudaArgs args)
{
    GSC_DYNAMIC_SHARED(memory);
    BlendShared<Rules, kRows>& shared = *reinterpret_cast<BlendShared<Rules, kRows>*>(memory);
    const uint32_t lane = threadIdx.x & 31u, warp = threadIdx.x >> 5;
    const uint32_t bins = args.grid.bins();
    const uint32_t hot = args.counters->pass.hot_bins;
    uint32_t evaluations[kMaxEyes] = {};
    const auto tally = [&](uint32_t entry, uint32_t seen) {
        evaluations[0] += entry < bins ? seen : 0u;
        evaluations[1] += entry < bins ? 0u : seen;
    };

    const Team everyone{0, kThreads, threadIdx.x};
    if (threadIdx.x == 0)
        shared.batches[kThreads] = Rules::nothing();
    while (true) {
        if (threadIdx.x == 0)
            shared.next[0] = atomicAdd(&args.counters->pass.next_hot, 1u);
        everyone.sync();
        const uint32_t i = shared.next[0];
        everyone.sync();
        if (i >= hot)
            break;
        const uint32_t entry = args.bin_queue[i], bin = entry >= bins ? entry - bins : entry;
        uint32_t seen = 0;
        // narrow tiles: far splats crowd in a few rows of pixels, and this spreads a row over many warps
        blendBin<Rules, Tile<4, kRows / 2, 1>>(args, everyone, shared.batches, shared.lists[warp], entry,
                                               bin % args.grid.columns * kBinWidth + warp % 8 * 4,
                                               bin / args.grid.columns * (8 * kRows) + warp / 8 * (4 * kRows), seen);
        tally(entry, seen);
    }

    const uint32_t g = threadIdx.x / kGroup;
    const Team group{1 + g, kGroup, threadIdx.x % kGroup};
    typename Rules::Lit* batch = shared.batches + g * (kGroup + 1);
    if (group.thread == 0)
        batch[kGroup] = Rules::nothing();
    while (true) {
        if (group.thread == 0)
            shared.next[g] = hot + atomicAdd(&args.counters->pass.next_bin, 1u);
        group.sync();
        const uint32_t i = shared.next[g];
        group.sync();
        if (i >= args.eye_count * bins)
            break;
        const uint32_t entry = args.bin_queue[i], bin = entry >= bins ? entry - bins : entry;
        uint32_t seen = 0;
        blendBin<Rules, Tile<8, kRows, 2>>(args, group, batch, shared.lists[warp], entry,
                                           bin % args.grid.columns * kBinWidth + warp % 2 * 16,
                                           bin / args.grid.columns * (8 * kRows) + warp % 4 / 2 * (4 * kRows), seen);
        tally(entry, seen);
    }
    // counted by warp: every lane holds the same
    for (uint32_t e = 0; e < kMaxEyes; ++e)
        if (lane == 0 && evaluations[e] != 0)
            atomicAdd(&args.counters->evaluations[e], 32ull * evaluations[e]);
}

template <typename Rules, uint32_t kRows>
void launchRows(const BlendCudaArgs& args, uint32_t processors, CUstream_st* stream)
{
    // blocks take bins from a queue, so more of them than the device holds at once would only wait for nothing
    launchCuda(blendKernel<Rules, kRows>, processors * kBlocksPerProcessor, kThreads, sizeof(BlendShared<Rules, kRows>),
               stream, args);
}

template <typename Rules>
void launch(const BlendCudaArgs& args, uint32_t processors, CUstream_st* stream)
{
    if (args.grid.height == 16)
        launchRows<Rules, 2>(args, processors, stream);
    else
        launchRows<Rules, 4>(args, processors, stream);
}

} // namespace

void prepareBlendCuda()
{
    raiseSharedLimit(blendKernel<FastRules, 2>, sizeof(BlendShared<FastRules, 2>));
    raiseSharedLimit(blendKernel<FastRules, 4>, sizeof(BlendShared<FastRules, 4>));
    raiseSharedLimit(blendKernel<ExactRules, 2>, sizeof(BlendShared<ExactRules, 2>));
    raiseSharedLimit(blendKernel<ExactRules, 4>, sizeof(BlendShared<ExactRules, 4>));
}

void blendFastCuda(const BlendCudaArgs& args, uint32_t processors, CUstream_st* stream)
{
    launch<FastRules>(args, processors, stream);
}

void blendExactCuda(const BlendCudaArgs& args, uint32_t processors, CUstream_st* stream)
{
    launch<ExactRules>(args, processors, stream);
}

} // namespace gsc
