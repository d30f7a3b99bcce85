// SPDX-License-Identifier: Apache-2.0
// How a warp blends one sub-tile of a long list by itself.
#pragma once

#include "kernels/blend/blend_bin.cuh"
#include "kernels/blend/touch.cuh"

namespace gsc {

constexpr uint32_t kLoneBatch = 32; // splats that a warp blends at once, in whole fours
constexpr uint32_t kLoneThreads = 128;

// Blends keys of a long list, those of `units` units, into sub-tile `sub_tile` of its bin. goes_on: the sub-tile has met
// those before. lits: kLoneBatch of this warp's. The same bytes as blendBin(), but for the ends of needles, whose bounds are
// rounding. Returns whether it takes more; where there is more it is then left to be taken up again.
template <typename Rules, typename T>
__device__ __forceinline__ bool blendTile(const BlendCudaArgs& args, const Area& area, uint32_t first_unit,
                                          uint32_t units, bool goes_on, bool more, uint32_t sub_tile,
                                          typename Rules::Lit* lits, uint32_t& evaluations)
{
    using Splat = typename Rules::Splat;
    using Lit = typename Rules::Lit;
    const uint32_t lane = threadIdx.x & 31u;
    const uint32_t x = area.bin_x + sub_tile % T::kBinColumns * T::kWidth + lane % T::kWidth;
    const uint32_t row = area.bin_y + sub_tile / T::kBinColumns * T::kHeight, y = row + lane / T::kWidth;
    const auto px = float(Rules::kInBin ? x - area.bin_x : x), py = float(Rules::kInBin ? y - area.bin_y : y);
    Begun pixel = begunPixel<Rules::kDepth>(args, area.eye, x, y, goes_on || args.pass.index != 0);
    uint32_t open = __ballot_sync(~0u, pixel.transmittance > 0.0f);
    if (open != 0) {
        const uint32_t first_slot = args.shared_bins ? area.eye * args.slot_capacity : 0u;
        const Splat* splats = static_cast<const Splat*>(args.splats) + first_slot;
        TouchReader<T> reader(args, first_unit, units, sub_tile, open);
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
        while (count != 0) {
            Lit lit = Rules::nothing();
            bool draws = false;
            if (lane < count) {
                lit = Rules::light(splat, float(area.bin_x), float(area.bin_y));
                if constexpr (Rules::kDepth)
                    lit.color[0] = depth;
                draws = true;
                if (open != ~0u) { // the reader leaves finished rows out only from its next unit on
                    const float top = splat.y - float(row), extent = Rules::bounds(splat).extent_y;
                    draws = top - extent <= float((31 - __clz(int(open))) / int(T::kWidth)) &&
                            top + extent >= float((__ffs(int(open)) - 1) / int(T::kWidth));
                }
            }
            const uint32_t drawing = __ballot_sync(~0u, draws), drawn = uint32_t(__popc(drawing));
            if (draws)
                lits[__popc(drawing & ((1u << lane) - 1u))] = lit;
            if (lane < ((0u - drawn) & 3u)) // whole fours
                lits[drawn + lane] = Rules::nothing();
            count = next_count;
            splat = fetch(slot, count);
            depth = depthOf(slot, count);
            next_count = reader.next(key, open);
            slot = slotOf(key, next_count);
            __syncwarp();
            for (const Lit *at = lits, *const end = lits + drawn; at < end; at += 4) {
                const Lit* const chosen[4] = {at, at + 1, at + 2, at + 3};
                Rules::blend(chosen, args, px, py, pixel.transmittance, pixel.color);
            }
            __syncwarp(); // the batch is written again
            evaluations += drawn;
            open = __ballot_sync(~0u, pixel.transmittance > 0.0f);
            if (open == 0)
                break;
        }
    }
    more = more && open != 0;
    endPixel<Rules::kDepth>(args, area.eye, x, y, pixel.transmittance, pixel.color,
                            !more && args.pass.index + 1 == args.pass.count);
    return more;
}

// What of the long lists a launch blends.
enum class LongPart : uint32_t {
    First,  // of the longest lists their first units: most sub-tiles are finished by then
    Behind, // what is behind those, and all of the other lists, which keep the device busy meanwhile
    All     // every list, as far as its units were found: depths, which pixels have before their light ends
};

// Each sub-tile by a warp.
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
    constexpr uint32_t kSubTiles = T::kBinRows * T::kBinColumns;
    __shared__ typename Rules::Lit lits[kLoneThreads / 32][kLoneBatch];
    uint32_t evaluations[kMaxEyes] = {};
    while (true) {
        uint32_t tile = 0;
        if ((threadIdx.x & 31u) == 0)
            tile = atomicAdd(&args.counters->pass.next_tile[uint32_t(part)], 1u);
        tile = __shfl_sync(~0u, tile, 0);
        const uint32_t i = tile / kSubTiles, sub_tile = tile % kSubTiles;
        if (i >= bins)
            break;
        const BinOfEye bin = binAt(args, i);
        const bool behind = part == LongPart::Behind && i < longest;
        Area area{};
        if (!areaOf<T>(args, bin, area) || (behind && (unfinishedOf(args, bin.entry, bin.eye) >> sub_tile & 1u) == 0))
            continue;
        const uint32_t all = (area.end - area.begin + kTouchUnit - 1) / kTouchUnit;
        const bool first_only =
            part == LongPart::First || (part == LongPart::All && unfinishedOf(args, bin.entry, bin.eye) == 0);
        const uint32_t from = behind ? kFirstUnits : 0u, to = first_only ? min(all, kFirstUnits) : all;
        const uint32_t first_unit = args.bin_units[bin.entry] + (args.shared_bins ? bin.eye * all : 0u);
        area.begin += from * kTouchUnit;
        uint32_t seen = 0;
        if (blendTile<Rules, T>(args, area, first_unit + from, to - from, behind, part == LongPart::First && to != all,
                                sub_tile, lits[threadIdx.x / 32], seen) &&
            (threadIdx.x & 31u) == 0)
            atomicOr(&unfinishedOf(args, bin.entry, bin.eye), 1u << sub_tile);
        evaluations[0] += bin.eye == 0 ? seen : 0u;
        evaluations[1] += bin.eye == 0 ? 0u : seen;
    }
    if constexpr (!Rules::kDepth)
        countEvaluations(args, evaluations);
}

} // namespace gsc
