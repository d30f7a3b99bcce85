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

// Where in its bin a splat draws.
struct alignas(8) Touched {
    uint32_t sub_tiles;           // bit per sub-tile
    uint16_t first_row, last_row; // of pixels, counted from the bin's first
};

// Blends `m` splats of shared memory, front to back, into the tile of this warp; the one after the team's last draws
// nothing. First the splats of every sub-tile are listed, then each list is blended: a warp that tests and one that
// blends both keep all lanes busy. (row0, column0): of the tile in its bin, in sub-tiles. lists: this warp's, one entry
// per sub-tile and thread of the team. Returns the sub-tiles still open.
template <typename Rules, typename T>
__device__ __forceinline__ uint32_t blendBatch(const typename Rules::Lit* splats, const Touched* touched, uint32_t m,
                                               uint32_t threads, uint32_t row0, uint32_t column0, uint16_t* lists,
                                               const BlendCudaArgs& args, uint32_t x0, uint32_t y0, uint32_t open,
                                               T& tile, uint32_t& evaluations)
{
    using Lit = typename Rules::Lit;
    constexpr bool kOne = T::kRows * T::kColumns == 1;
    if (open == 0)
        return 0;
    const uint32_t lane = threadIdx.x & 31u, shift = row0 * T::kBinColumns + column0;
    uint32_t first_open = 0, last_open = 0;
    if constexpr (kOne) { // what is finished shrinks the tile
        const uint32_t pixels = __ballot_sync(~0u, tile.transmittance[0][0] > 0.0f);
        first_open = row0 * T::kHeight + uint32_t(__ffs(int(pixels)) - 1) / T::kWidth;
        last_open = row0 * T::kHeight + uint32_t(31 - __clz(int(pixels))) / T::kWidth;
    }
    uint32_t counts[T::kRows * T::kColumns] = {};
    for (uint32_t start = 0; start < m; start += 32) {
        uint32_t mask = start + lane < m ? touched[start + lane].sub_tiles >> shift : 0u;
        if constexpr (kOne)
            if (mask != 0 &&
                (touched[start + lane].first_row > last_open || touched[start + lane].last_row < first_open))
                mask = 0;
#pragma unroll
        for (uint32_t t = 0; t < T::kRows * T::kColumns; ++t) {
            const uint32_t bit = t / T::kColumns * T::kBinColumns + t % T::kColumns;
            const bool hit = (mask >> bit & open >> t & 1u) != 0;
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

// What a splat draws in of the bin at pixel (x0, y0).
template <typename Rules, typename T>
__device__ __forceinline__ Touched touchedBy(const typename Rules::Splat& splat, const typename Rules::Lit& lit,
                                             const RasterConstants& rules, uint32_t x0, uint32_t y0)
{
    const Bounds bounds = Rules::bounds(splat, lit);
    const float top = lit.y - float(y0);
    return {subTileMask<T>(bounds, Rules::box(splat, rules), lit.x, lit.y, float(x0), float(y0)),
            uint16_t(fmaxf(floorf(top - bounds.extent_y), 0.0f)),
            uint16_t(fminf(fmaxf(ceilf(top + bounds.extent_y), 0.0f), 65535.0f))};
}

// A team's room for splats: two batches, so that one is filled while slower warps still blend the other.
template <typename Lit>
struct Batches {
    Lit* splats[2]; // one per thread of the team and one more
    Touched* touched[2];
    uint16_t* lists; // this warp's
};

// A bin as one eye draws it.
struct BinOfEye {
    uint32_t entry, eye; // entry: list x bins + bin
};

// Number `i` of the bins that are blended, fullest first. Eyes that share a list follow each other.
__device__ __forceinline__ BinOfEye binAt(const BlendCudaArgs& args, uint32_t i)
{
    if (args.shared_bins)
        return {args.bin_queue[i / kMaxEyes], i % kMaxEyes};
    const uint32_t entry = args.bin_queue[i];
    return {entry, entry >= args.grid.bins() ? 1u : 0u};
}

// Blends one bin; (row, column): of this warp's tile, in sub-tiles.
template <typename Rules, typename T>
__device__ __forceinline__ void blendBin(const BlendCudaArgs& args, const Team& team,
                                         const Batches<typename Rules::Lit>& batches, const BinOfEye& target,
                                         uint32_t row0, uint32_t column0, uint32_t& evaluations)
{
    using Splat = typename Rules::Splat;
    const uint32_t lane = threadIdx.x & 31u, e = target.eye, entry = target.entry;
    const Splat* all = static_cast<const Splat*>(args.splats);
    const uint32_t first_slot = args.shared_bins ? e * args.slot_capacity : 0u;
    const uint32_t bin = entry < args.grid.bins() ? entry : entry - args.grid.bins();
    const uint32_t eye_column = bin % args.grid.columns - (e == 0 ? args.grid.shift[0] : args.grid.shift[1]);
    if (eye_column >= args.grid.columns)
        return; // left of the eye's image
    const uint32_t bin_x = eye_column * kBinWidth;
    const uint32_t bin_y = bin / args.grid.columns * (T::kBinRows * T::kHeight);
    const uint32_t x0 = bin_x + column0 * T::kWidth, y0 = bin_y + row0 * T::kHeight;
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
    const auto slotAt = [&](uint32_t i) { return i < end ? args.keys[i].slot + first_slot : 0u; };
    const auto fetch = [&](uint32_t i, uint32_t slot) {
        Splat s;
        if (i < end)
#pragma unroll
            for (uint32_t part = 0; part < sizeof(Splat) / 16; ++part)
                reinterpret_cast<uint4*>(&s)[part] = reinterpret_cast<const uint4*>(all + slot)[part];
        return s;
    };
    Splat splat = fetch(at, slotAt(at));
    uint32_t slot = slotAt(at + team.threads), which = 0;
    for (uint32_t first = begin; first < end; first += team.threads, which ^= 1u) {
        typename Rules::Lit* const batch = which == 0 ? batches.splats[0] : batches.splats[1];
        Touched* const touched = which == 0 ? batches.touched[0] : batches.touched[1];
        if (at < end) {
            const typename Rules::Lit lit = Rules::light(splat);
            batch[team.thread] = lit;
            touched[team.thread] = touchedBy<Rules, T>(splat, lit, args.rules, bin_x, bin_y);
        }
        at += team.threads;
        splat = fetch(at, slot);
        slot = slotAt(at + team.threads);
        if (!team.any(open != 0)) // also: the batch is complete, and nobody blends the one before the last any more
            break;
        open = blendBatch<Rules>(batch, touched, min(team.threads, end - first), team.threads, row0, column0,
                                 batches.lists, args, x0, y0, open, tile, evaluations);
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
    static_assert((kThreads + 1) * sizeof(typename Rules::Lit) < 1u << 16); // an offset of a list

    typename Rules::Lit batches[2][kGroups * (kGroup + 1)]; // one of all threads in a hot bin
    Touched touched[2][kThreads];
    // per warp: sub-tiles x splats of a batch, of a group or of the whole block
    alignas(8) uint16_t lists[kThreads / 32][kRows * 2 * kGroup];
    uint32_t next[kGroups];
};

// kRows: rows of sub-tiles of a warp that shares its bin with three others.
template <typename Rules, uint32_t kRows>
__global__ void __launch_bounds__(kThreads, kBlocksPerProcessor) blendKernel(const __grid_constant__ BlendCudaArgs args)
{
    if (willRepeat(*args.counters))
        return;
    GSC_DYNAMIC_SHARED(memory);
    using Shared = BlendShared<Rules, kRows>;
    static_assert(sizeof(Shared) <= 99 * 1024); // what a block can have on compute capability 8.6, 8.9 and 12.0
    Shared& shared = *reinterpret_cast<Shared*>(memory);
    const uint32_t lane = threadIdx.x & 31u, warp = threadIdx.x >> 5;
    const uint32_t readers = args.shared_bins ? kMaxEyes : 1u;
    const uint32_t all_bins = args.eye_count * args.grid.bins(), hot = readers * args.counters->pass.hot_bins;
    uint32_t evaluations[kMaxEyes] = {};
    const auto tally = [&](uint32_t e, uint32_t seen) {
        evaluations[0] += e == 0 ? seen : 0u;
        evaluations[1] += e == 0 ? 0u : seen;
    };

    const Team everyone{0, kThreads, threadIdx.x};
    const Batches<typename Rules::Lit> all{
        {shared.batches[0], shared.batches[1]}, {shared.touched[0], shared.touched[1]}, shared.lists[warp]};
    if (threadIdx.x < 2)
        shared.batches[threadIdx.x][kThreads] = Rules::nothing();
    while (true) {
        if (threadIdx.x == 0)
            shared.next[0] = atomicAdd(&args.counters->pass.next_hot, 1u);
        everyone.sync();
        const uint32_t i = shared.next[0];
        everyone.sync();
        if (i >= hot)
            break;
        uint32_t seen = 0;
        // narrow tiles: far splats crowd in a few rows of pixels, and this spreads a row over many warps
        const BinOfEye bin = binAt(args, i);
        blendBin<Rules, Tile<4, 8 * kRows, kRows / 2, 1>>(args, everyone, all, bin, warp / 8 * (kRows / 2), warp % 8,
                                                          seen);
        tally(bin.eye, seen);
    }

    const uint32_t g = threadIdx.x / kGroup;
    const Team group{1 + g, kGroup, threadIdx.x % kGroup};
    const Batches<typename Rules::Lit> own{{shared.batches[0] + g * (kGroup + 1), shared.batches[1] + g * (kGroup + 1)},
                                           {shared.touched[0] + g * kGroup, shared.touched[1] + g * kGroup},
                                           shared.lists[warp]};
    if (group.thread < 2)
        shared.batches[group.thread][g * (kGroup + 1) + kGroup] = Rules::nothing();
    while (true) {
        if (group.thread == 0)
            shared.next[g] = hot + atomicAdd(&args.counters->pass.next_bin, 1u);
        group.sync();
        const uint32_t i = shared.next[g];
        group.sync();
        if (i >= all_bins)
            break;
        uint32_t seen = 0;
        const BinOfEye bin = binAt(args, i);
        blendBin<Rules, Tile<8, 8 * kRows, kRows, 2>>(args, group, own, bin, warp % 4 / 2 * kRows, warp % 2 * 2, seen);
        tally(bin.eye, seen);
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
