// SPDX-License-Identifier: Apache-2.0
// Blends short lists: four warps blend a bin together.
#pragma once

#include "kernels/blend/cuda/bins.cuh"
#include "kernels/cuda/launch.cuh"

#include <type_traits>

namespace gsc {

constexpr uint32_t kBlendThreads = 256;
constexpr uint32_t kGroup = 128; // threads that blend a bin together if its list is short
constexpr uint32_t kGroups = kBlendThreads / kGroup;
constexpr uint32_t kBlendBlocks = 3; // blocks that run on a multiprocessor at once
static_assert(kBinWidth == 32);

// Threads of a block that blend one bin together.
struct Team {
    uint32_t barrier, thread;

    __device__ __forceinline__ void sync() const { barrierSync(barrier, kGroup); }
    __device__ __forceinline__ bool any(bool value) const { return barrierAny(barrier, kGroup, value); }
};

// First sub-tiles of this warp in a bin that it shares with three others: each has a quarter.
template <typename T>
__device__ __forceinline__ PairPlace quarterOfBin()
{
    const uint32_t warp = threadIdx.x / 32;
    return {(warp >> 1 & 1u) * T::kRows, 2 * (warp & 1u)};
}

// Place of a splat in a list of a sub-tile: in bytes from the block's first splat (BlendShared::batches). It is a word
// where memory allows, since half words must be taken apart in the loop.
template <typename T>
using ListEntry = std::conditional_t<T::kRows * T::kColumns <= 4, uint32_t, uint16_t>;

template <typename Entry>
struct alignas(4 * sizeof(Entry)) FourEntries {
    Entry at[4];
};

// Blends `m` splats in shared memory, front to back, into the tile of this warp; one splat behind them draws nothing.
// First the splats of every sub-tile are listed, then each list is blended: so all lanes of a warp are busy in both.
// memory: first splat of the block; batch: start of the batch in bytes from there. (x0, y0): first pixel of the bin, in
// the coordinates that the rules use. lists: this warp's, with one entry for each sub-tile and thread of the team.
// Returns the sub-tiles that still take light, a bit each.
template <typename Rules, typename T>
__device__ __forceinline__ uint32_t blendBatch(const char* memory, uint32_t batch, const uint32_t* touched, uint32_t m,
                                               ListEntry<T>* lists, const BlendCudaArgs& args, uint32_t x0, uint32_t y0,
                                               uint32_t open, T& tile, uint32_t& evaluations)
{
    using Lit = typename Rules::Lit;
    using Entry = ListEntry<T>;
    if (open == 0)
        return 0;
    const uint32_t lane = threadIdx.x & 31u;
    const PairPlace pairs = quarterOfBin<T>();
    const uint32_t shift = pairs.row * T::kBinColumns + pairs.column;
    uint32_t counts[T::kRows * T::kColumns] = {};
    for (uint32_t start = 0; start < m; start += 32) {
        const uint32_t mask = start + lane < m ? touched[start + lane] >> shift : 0u;
#pragma unroll
        for (uint32_t t = 0; t < T::kRows * T::kColumns; ++t) {
            const uint32_t bit = t / T::kColumns * T::kBinColumns + t % T::kColumns;
            const bool hit = (mask >> bit & open >> t & 1u) != 0;
            const uint32_t hits = __ballot_sync(~0u, hit);
            if (hit)
                lists[t * kGroup + counts[t] + __popc(hits & ((1u << lane) - 1u))] =
                    Entry(batch + (start + lane) * sizeof(Lit));
            counts[t] += __popc(hits);
        }
    }
#pragma unroll
    for (uint32_t t = 0; t < T::kRows * T::kColumns; ++t)
        // fills up to four entries; a list of all splats of the team has whole fours
        if (lane < ((0u - counts[t]) & 3u))
            lists[t * kGroup + counts[t] + lane] = Entry(batch + kGroup * sizeof(Lit));
    __syncwarp();
    const uint32_t half = halfOfWarp();
    const float least[2] = {args.lifted_stop, args.lifted_stop};
#pragma unroll
    for (uint32_t row = 0; row < T::kRows; ++row) {
        const uint32_t left = counts[2 * row], right = counts[2 * row + 1], count = half == 0 ? left : right;
        if (left + right == 0)
            continue;
        float(&transmittance)[2] = tile.transmittance[row];
        const PixelPair at = pixelPair<T>(x0, y0, pairs, row);
        const auto* four = reinterpret_cast<const FourEntries<Entry>*>(lists + (2 * row + half) * kGroup);
        const auto* const end = four + (count + 3) / 4;
        for (; four < end; ++four) {
            const FourEntries<Entry> entries = *four;
            const Lit* const chosen[4] = {reinterpret_cast<const Lit*>(memory + entries.at[0]),
                                          reinterpret_cast<const Lit*>(memory + entries.at[1]),
                                          reinterpret_cast<const Lit*>(memory + entries.at[2]),
                                          reinterpret_cast<const Lit*>(memory + entries.at[3])};
            Rules::blend(chosen, args, at, least, transmittance, tile.color[row]);
        }
        evaluations += left + right;
        const uint32_t taking =
            halvesThat(Rules::takesLight(transmittance[0], least[0]) || Rules::takesLight(transmittance[1], least[1]));
        open &= ~(3u << 2 * row) | taking << 2 * row; // pixels of a sub-tile that is not open take no light again
    }
    __syncwarp(); // waits before the lists are written again
    return open;
}

// Memory of a team for splats: two batches, so that one is filled while slower warps still blend the other.
template <typename Lit, typename Entry>
struct Batches {
    char* memory; // memory of the block for splats
    // start of each batch in bytes from `memory`; a batch has one splat for each thread of the team and one more
    uint32_t splats[2];
    uint32_t* touched[2]; // for each splat of a batch: a bit for each sub-tile of the bin that it touches
    Entry* lists;         // lists of this warp, one for each sub-tile

    __device__ __forceinline__ Lit* at(uint32_t batch) const { return reinterpret_cast<Lit*>(memory + batch); }
};

// Blends a bin's list into the tiles of a team. open: bits of the warp's sub-tiles that take light.
template <typename Rules, typename T>
__device__ __forceinline__ void blendKeys(const BlendCudaArgs& args, const Team& team,
                                          const Batches<typename Rules::Lit, ListEntry<T>>& batches, const Area& area,
                                          uint32_t open, T& tile, uint32_t& evaluations)
{
    using Splat = typename Rules::Splat;
    const Splat* all = static_cast<const Splat*>(args.splats);
    const uint32_t first_slot = args.shared_bins ? area.eye * args.slot_capacity : 0u, end = area.end;
    // while a batch is blended, the splat of the next batch and the slot of the one after it are being loaded
    uint32_t at = area.begin + team.thread;
    const auto slotAt = [&](uint32_t i) { return i < end ? args.keys[i].slot + first_slot : 0u; };
    const auto fetch = [&](uint32_t i, uint32_t slot) {
        Splat s;
        if (i < end)
#pragma unroll
            for (uint32_t part = 0; part < sizeof(Splat) / 16; ++part)
                reinterpret_cast<uint4*>(&s)[part] = reinterpret_cast<const uint4*>(all + slot)[part];
        return s;
    };
    // an index of a list's splats, which eyes may share, so without first_slot
    const auto depthOf = [&](uint32_t i, uint32_t slot) {
        return Rules::kDepth && i < end ? __uint_as_float(args.places[slot - first_slot].depth_bits) : 0.0f;
    };
    Splat splat = fetch(at, slotAt(at));
    float depth = depthOf(at, slotAt(at));
    uint32_t slot = slotAt(at + kGroup), which = 0;
    for (uint32_t first = area.begin; first < end; first += kGroup, which ^= 1u) {
        const uint32_t batch = which == 0 ? batches.splats[0] : batches.splats[1];
        uint32_t* const touched = which == 0 ? batches.touched[0] : batches.touched[1];
        if (at < end) {
            typename Rules::Lit lit = Rules::light(splat, args, float(area.bin_x), float(area.bin_y));
            if constexpr (Rules::kDepth)
                lit.color[0] = depth;
            batches.at(batch)[team.thread] = lit;
            touched[team.thread] = subTileMask<T>(Rules::bounds(splat), Rules::box(splat, args.rules), splat.x, splat.y,
                                                  float(area.bin_x), float(area.bin_y));
        }
        at += kGroup;
        splat = fetch(at, slot);
        depth = depthOf(at, slot);
        slot = slotAt(at + kGroup);
        // also a barrier: this batch is complete, and no thread still blends the batch before the last one
        if (!team.any(open != 0))
            break;
        open = blendBatch<Rules>(batches.memory, batch, touched, min(kGroup, end - first), batches.lists, args,
                                 Rules::kInBin ? 0u : area.bin_x, Rules::kInBin ? 0u : area.bin_y, open, tile,
                                 evaluations);
    }
}

// Blends one bin, whose list is short.
template <typename Rules, typename T>
__device__ __forceinline__ void blendBin(const BlendCudaArgs& args, const Team& team,
                                         const Batches<typename Rules::Lit, ListEntry<T>>& batches, const Area& area,
                                         uint32_t& evaluations)
{
    T tile;
    uint32_t open = 0;
    forPixels<T>(quarterOfBin<T>(), [&](uint32_t row, uint32_t i, uint32_t x, uint32_t y) {
        const Begun begun = begunPixel<Rules>(args, area.eye, area.bin_x + x, area.bin_y + y, args.pass.index != 0);
        for (int c = 0; c < 3; ++c)
            tile.color[row][i][c] = begun.color[c];
        tile.transmittance[row][i] = begun.transmittance;
        open |= halvesThat(Rules::takesLight(begun.transmittance, args.lifted_stop)) << 2 * row;
    });
    if (args.pass.index == 0 || team.any(open != 0)) // false if nearer passes have finished all pixels
        blendKeys<Rules>(args, team, batches, area, open, tile, evaluations);
    forPixels<T>(quarterOfBin<T>(), [&](uint32_t row, uint32_t i, uint32_t x, uint32_t y) {
        endPixel<Rules>(args, area.eye, area.bin_x + x, area.bin_y + y, tile.transmittance[row][i], tile.color[row][i],
                        args.pass.index + 1 == args.pass.count);
    });
}

template <typename Rules, uint32_t kRows>
struct BlendShared {
    using Tile = gsc::Tile<8, 8 * kRows, kRows>;
    using Entry = ListEntry<Tile>;
    // a place in bytes fits an entry of a list
    static_assert(2 * kGroups * (kGroup + 1) * sizeof(typename Rules::Lit) < 1u << 16);

    typename Rules::Lit batches[2][kGroups][kGroup + 1];
    uint32_t touched[2][kBlendThreads];
    alignas(16) Entry lists[kBlendThreads / 32][kRows * 2 * kGroup]; // for each warp: sub-tiles x splats of a batch
    uint32_t next[kGroups];
};

} // namespace gsc
