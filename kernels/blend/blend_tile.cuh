// SPDX-License-Identifier: Apache-2.0
// How a warp blends two sub-tiles of a long list by itself.
#pragma once

#include "kernels/blend/blend_bin.cuh"
#include "kernels/blend/touch.cuh"

namespace gsc {

constexpr uint32_t kLoneThreads = 128;

// Two sub-tiles of a bin that lie beside each other, one for each half of a warp.
struct SubTiles {
    uint32_t left;   // the first's number
    uint32_t wanted; // bit for either
    bool goes_on;    // they have met the keys before those
};

// Shared memory of half a warp.
template <typename Rules>
struct LoneShared {
    typename Rules::Lit lits[kHalf];
    uint16_t places[kPartKeys];
};

// Blends keys of a long list, those of `units` units, into sub-tiles of its bin. The same bytes as blendBin(), but for the
// ends of needles, whose bounds are rounding. Returns which take more; where there is more they are then left to be taken up
// again.
template <typename Rules, typename T>
__device__ __forceinline__ uint32_t blendTile(const BlendCudaArgs& args, const Area& area, uint32_t first_unit,
                                              uint32_t units, bool more, const SubTiles& sub_tiles,
                                              LoneShared<Rules>& shared, uint32_t& evaluations)
{
    using Splat = typename Rules::Splat;
    using Lit = typename Rules::Lit;
    const uint32_t lane = threadIdx.x % kHalf, half = halfOfWarp(), sub_tile = sub_tiles.left + half;
    const bool wanted = (sub_tiles.wanted >> half & 1u) != 0;
    const PairPlace pair{sub_tiles.left / T::kBinColumns, sub_tiles.left % T::kBinColumns};
    const PixelPair at = pixelPair<T>(Rules::kInBin ? 0u : area.bin_x, Rules::kInBin ? 0u : area.bin_y, pair, 0);
    T tile;
    forPixels<T>(pair, [&](uint32_t, uint32_t i, uint32_t x, uint32_t y) {
        const Begun begun = begunPixel<Rules>(args, area.eye, area.bin_x + x, area.bin_y + y,
                                              sub_tiles.goes_on || args.pass.index != 0);
        tile.transmittance[0][i] = begun.transmittance;
        for (int c = 0; c < 3; ++c)
            tile.color[0][i][c] = begun.color[c];
    });
    float(&transmittance)[2] = tile.transmittance[0];
    const auto taking = [&] {
        return ballotOfHalf(wanted &&
                            (Rules::takesLight(transmittance[0], args) || Rules::takesLight(transmittance[1], args)));
    };
    uint32_t open = taking();
    if (__any_sync(~0u, open != 0)) {
        const uint32_t first_slot = args.shared_bins ? area.eye * args.slot_capacity : 0u;
        const Splat* splats = static_cast<const Splat*>(args.splats) + first_slot;
        TouchReader<T> reader(args, first_unit, units, sub_tile, open, shared.places);
        const auto slotOf = [&](uint32_t key, uint32_t count) {
            return lane < count ? args.keys[area.begin + key].slot : 0u;
        };
        const auto fetch = [&](uint32_t slot, uint32_t count) {
            Splat s;
            if (lane < count)
#pragma unroll
                for (uint32_t part = 0; part < sizeof(Splat) / 16; ++part)
                    reinterpret_cast<uint4*>(&s)[part] = reinterpret_cast<const uint4*>(splats + slot)[part];
            return s;
        };
        const auto depthOf = [&](uint32_t slot, uint32_t count) { // places are those of lists, which eyes may share
            return Rules::kDepth && lane < count ? __uint_as_float(args.places[slot].depth_bits) : 0.0f;
        };
        // the splats of the next batch are on their way while this one is blended, and the slots of the one after it
        uint32_t key = 0, count = reader.next(key, open), slot = slotOf(key, count);
        Splat splat = fetch(slot, count);
        float depth = depthOf(slot, count);
        uint32_t next_count = reader.next(key, open);
        slot = slotOf(key, next_count);
        while (__any_sync(~0u, count != 0)) {
            // Of a splat that nobody needs nothing is left; its order is asked for, though no splat has this one, so that its
            // register is not given to other things, which would wait for the load.
            Lit lit = Rules::nothing();
            if (lane < count && splat.order != ~0u) {
                lit = Rules::light(splat, args, float(area.bin_x), float(area.bin_y));
                if constexpr (Rules::kDepth)
                    lit.color[0] = depth;
            }
            const uint32_t drawn = count;
            if (lane < ((drawn + 3) & ~3u)) // whole fours
                shared.lits[lane] = lit;
            count = next_count;
            splat = fetch(slot, count);
            depth = depthOf(slot, count);
            next_count = reader.next(key, open);
            slot = slotOf(key, next_count);
            __syncwarp();
            for (const Lit *four = shared.lits, *const end = four + drawn; four < end; four += 4) {
                const Lit* const chosen[4] = {four, four + 1, four + 2, four + 3};
                Rules::blend(chosen, args, at, transmittance, tile.color[0]);
            }
            __syncwarp(); // the batch is written again
            evaluations += drawn;
            open = taking();
            if (open == 0) {
                reader.stop();
                count = next_count = 0;
            }
        }
    }
    const bool left_open = more && open != 0;
    if (wanted)
        forPixels<T>(pair, [&](uint32_t, uint32_t i, uint32_t x, uint32_t y) {
            endPixel<Rules>(args, area.eye, area.bin_x + x, area.bin_y + y, transmittance[i], tile.color[0][i],
                            !left_open && args.pass.index + 1 == args.pass.count);
        });
    return halvesThat(left_open);
}

// What of the long lists a launch blends.
enum class LongPart : uint32_t {
    First,  // of the longest lists their first units: most sub-tiles are finished by then
    Behind, // what is behind those, and all of the other lists, which keep the device busy meanwhile
    All     // every list, as far as its units were found: depths, which pixels have before their light ends
};

// Two sub-tiles by a warp.
template <typename Rules, uint32_t kRows>
__global__ void __launch_bounds__(kLoneThreads, Rules::kLoneBlocks)
    tileKernel(const __grid_constant__ BlendCudaArgs args, LongPart part)
{
    launchDependents(); // the other bins take the multiprocessors that this leaves
    const PassCounters& pass = args.counters->pass;
    const uint32_t readers = args.shared_bins ? kMaxEyes : 1u, longest = readers * pass.longest_bins;
    const uint32_t bins = part == LongPart::First ? longest : readers * pass.long_bins;
    if (bins == 0 || willRepeat(*args.counters))
        return;
    using T = LoneTile<kRows>;
    constexpr uint32_t kPairs = T::kBinRows * T::kBinColumns / 2;
    __shared__ LoneShared<Rules> shared[kLoneThreads / kHalf];
    uint32_t evaluations[kMaxEyes] = {};
    while (true) {
        uint32_t pair = 0;
        if ((threadIdx.x & 31u) == 0)
            pair = atomicAdd(&args.counters->pass.next_tile[uint32_t(part)], 1u);
        pair = __shfl_sync(~0u, pair, 0);
        const uint32_t i = pair / kPairs;
        if (i >= bins)
            break;
        const BinOfEye bin = binAt(args, i);
        const bool behind = part == LongPart::Behind && i < longest;
        SubTiles sub_tiles{2 * (pair % kPairs), 3, behind};
        if (behind)
            sub_tiles.wanted = unfinishedOf(args, bin.entry, bin.eye) >> sub_tiles.left & 3u;
        Area area{};
        if (!areaOf<T>(args, bin, area) || sub_tiles.wanted == 0)
            continue;
        const uint32_t all = (area.end - area.begin + kTouchUnit - 1) / kTouchUnit;
        const bool first_only =
            part == LongPart::First || (part == LongPart::All && unfinishedOf(args, bin.entry, bin.eye) == 0);
        const uint32_t from = behind ? kFirstUnits : 0u, to = first_only ? min(all, kFirstUnits) : all;
        const uint32_t first_unit = args.bin_units[bin.entry] + (args.shared_bins ? bin.eye * all : 0u);
        area.begin += from * kTouchUnit;
        const bool goes_on = part == LongPart::First && to != all;
        uint32_t seen = 0; // by this half
        const uint32_t left_open = blendTile<Rules, T>(args, area, first_unit + from, to - from, goes_on, sub_tiles,
                                                       shared[threadIdx.x / kHalf], seen);
        if (goes_on && (threadIdx.x & 31u) == 0)
            atomicOr(&unfinishedOf(args, bin.entry, bin.eye), left_open << sub_tiles.left);
        seen += __shfl_xor_sync(~0u, seen, int(kHalf));
        evaluations[0] += bin.eye == 0 ? seen : 0u;
        evaluations[1] += bin.eye == 0 ? 0u : seen;
    }
    if constexpr (!Rules::kDepth)
        countEvaluations(args, evaluations);
}

} // namespace gsc
