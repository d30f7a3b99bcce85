// SPDX-License-Identifier: Apache-2.0
// Blends long lists: a warp blends two sub-tiles of a bin by itself.
#pragma once

#include "kernels/blend/cuda/bins.cuh"
#include "kernels/blend/cuda/segments.cuh"
#include "kernels/blend/cuda/touch.cuh"

namespace gsc {

constexpr uint32_t kLoneThreads = 128;

// Shared memory of one half of a warp.
template <typename Rules>
struct LoneShared {
    typename Rules::Lit lits[kHalf];
    uint16_t places[kPartKeys];
};

// Blends `units` units of a long list, from first_unit on, into the sub-tiles of a pair; each half of the warp has one.
// Gives the same bytes as blendBin(), except at the ends of needles, whose bounds are rounding. Returns true if the
// sub-tile of this half still takes light.
template <typename Rules, typename T>
__device__ __forceinline__ bool blendTile(const BlendCudaArgs& args, const Area& area, uint32_t first_unit,
                                          uint32_t units, const PairPlace& pair, const float (&least)[2], T& tile,
                                          LoneShared<Rules>& shared, uint32_t& evaluations)
{
    using Splat = typename Rules::Splat;
    using Lit = typename Rules::Lit;
    const uint32_t lane = threadIdx.x % kHalf, sub_tile = pair.row * T::kBinColumns + pair.column + halfOfWarp();
    const PixelPair at = pixelPair<T>(Rules::kInBin ? 0u : area.bin_x, Rules::kInBin ? 0u : area.bin_y, pair, 0);
    float(&transmittance)[2] = tile.transmittance[0];
    const auto taking = [&] {
        return ballotOfHalf(Rules::takesLight(transmittance[0], least[0]) ||
                            Rules::takesLight(transmittance[1], least[1]));
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
        // an index of a list's splats, which eyes may share, so without first_slot
        const auto depthOf = [&](uint32_t slot, uint32_t count) {
            return Rules::kDepth && lane < count ? __uint_as_float(args.places[slot].depth_bits) : 0.0f;
        };
        // while a batch is blended, the splats of the next batch and the slots of the one after it are being loaded
        uint32_t key = 0, count = reader.next(key, open), slot = slotOf(key, count);
        Splat splat = fetch(slot, count);
        float depth = depthOf(slot, count);
        uint32_t next_count = reader.next(key, open);
        slot = slotOf(key, next_count);
        while (__any_sync(~0u, count != 0)) {
            // A lane without a splat draws nothing. The comparison with `order`, which is always true, keeps the
            // register that the splat is loaded to from being given to other values, which would wait for the load.
            Lit lit = Rules::nothing();
            if (lane < count && splat.order != ~0u) {
                lit = Rules::light(splat, args, float(area.bin_x), float(area.bin_y));
                if constexpr (Rules::kDepth)
                    lit.color[0] = depth;
            }
            const uint32_t drawn = count;
            if (lane < ((drawn + 3) & ~3u)) // fills up with nothing to a multiple of four splats
                shared.lits[lane] = lit;
            count = next_count;
            splat = fetch(slot, count);
            depth = depthOf(slot, count);
            next_count = reader.next(key, open);
            slot = slotOf(key, next_count);
            __syncwarp();
            for (const Lit *four = shared.lits, *const end = four + drawn; four < end; four += 4) {
                const Lit* const chosen[4] = {four, four + 1, four + 2, four + 3};
                Rules::blend(chosen, args, at, least, transmittance, tile.color[0]);
            }
            __syncwarp(); // waits before the next batch is written to `lits`
            evaluations += drawn;
            open = taking();
            if (open == 0) {
                reader.stop();
                count = next_count = 0;
            }
        }
    }
    return open != 0;
}

// Part of the long lists that a launch blends (blend_kernel.cuh). All: every list as far as its units were found. It is
// for depths, which a pixel has before its light ends.
enum class LongPart : uint32_t { First, Behind, All };

// Way in which a warp blends a segment; Whole: the list is not cut into segments.
enum class SegmentWay : uint32_t { Whole, InTurn, Apart, Again };

// Work of a warp: two neighbouring sub-tiles of a long list, and the units [from, to) of the list that it blends.
struct LonePair {
    BinOfEye bin;
    uint32_t pair, from, to;
    uint32_t wanted;     // a bit for each of the two sub-tiles that still takes light
    uint32_t first_unit; // number of the list's first unit for this eye
    uint32_t segments;   // number of segments that the list is cut into behind its first units
    SegmentWay way;

    __device__ __forceinline__ uint32_t segment() const { return (from - kFirstUnits) / kSegmentUnits; }
    __device__ __forceinline__ uint32_t list() const { return first_unit + kFirstUnits; }
};

template <typename T>
__device__ __forceinline__ SegmentState& stateOf(const BlendCudaArgs& args, const LonePair& work)
{
    return args.segment_states[work.list() / kSegmentUnits * T::kBinPairs + work.pair];
}

// Number by which SegmentQueue and segment_pairs name a segment of a pair of sub-tiles.
template <typename T>
__device__ __forceinline__ uint32_t segmentItem(const LonePair& work, uint32_t segment)
{
    return (work.list() + segment * kSegmentUnits) * T::kBinPairs + work.pair;
}

// Joins a segment that was blended in turn to those before it. Returns true if the next segment is to be blended too.
template <typename Rules, typename T>
__device__ __forceinline__ bool endInTurn(const BlendCudaArgs& args, const LonePair& work, const Area& area,
                                          const PairPlace& place, bool wanted, const SegmentQueue& queue, const T& tile)
{
    const SegmentsOfTile<T> segments(args, work.list(), 2 * work.pair + halfOfWarp());
    SegmentPixel sums[2];
    bool open = false;
#pragma unroll
    for (uint32_t i = 0; i < 2; ++i) {
        const float *const color = tile.color[0][i], light = tile.transmittance[0][i];
        sums[i] = {{color[0], color[1], color[2]}, light};
        if (work.segment() != 0 && wanted) {
            sums[i] = segments.load(0, i);
            join<Rules>(args, sums[i], color, light);
        }
        open |= wanted && Rules::takesLight(sums[i].transmittance, args.lifted_stop);
    }
    const uint32_t next = work.segment() + 1;
    if (next == work.segments || !__any_sync(~0u, open)) {
        if (wanted)
            forPixels<T>(place, [&](uint32_t, uint32_t i, uint32_t x, uint32_t y) {
                endPixel<Rules>(args, area.eye, area.bin_x + x, area.bin_y + y, sums[i].transmittance, sums[i].color,
                                args.pass.index + 1 == args.pass.count);
            });
        return false;
    }
    if (wanted)
        for (uint32_t i = 0; i < 2; ++i)
            segments.store(0, i, sums[i].color, sums[i].transmittance);
    const bool lead = (threadIdx.x & 31u) == 0;
    if (!__any_sync(~0u, lead && queue.someoneWaits()))
        return true;
    __threadfence();
    __syncwarp();
    if (lead) {
        stateOf<T>(args, work) = {next, 0};
        queue.push(work.segments - next, [&](uint32_t i) { return segmentItem<T>(work, next + i); });
    }
    return false;
}

// Stores the result of a segment that was blended apart. The warp that finishes the pair's last segment joins them all.
template <typename Rules, typename T>
__device__ __forceinline__ void endApart(const BlendCudaArgs& args, const LonePair& work, const Area& area,
                                         const PairPlace& place, bool wanted, const SegmentQueue& queue, const T& tile)
{
    const SegmentsOfTile<T> segments(args, work.list(), 2 * work.pair + halfOfWarp());
    const bool again = work.way == SegmentWay::Again, lead = (threadIdx.x & 31u) == 0;
#pragma unroll
    for (uint32_t i = 0; i < 2; ++i)
        if (wanted && !again)
            segments.store(work.segment(), i, tile.color[0][i], tile.transmittance[0][i]);
        else if (tile.transmittance[0][i] > 0.0f) // true if the pixel's light ends in this segment
            segments.storeColor(work.segment(), i, tile.color[0][i]);
    __threadfence();
    __syncwarp();
    SegmentState& state = stateOf<T>(args, work);
    uint32_t first = 0, done = 0;
    if (lead) {
        first = __ldcg(&state.first);
        done = atomicAdd(&state.done, 1u) + 1;
    }
    first = __shfl_sync(~0u, first, 0);
    if (__shfl_sync(~0u, done, 0) != (again ? 0u : work.segments - first))
        return;
    __syncwarp();
    __threadfence();
    uint32_t ends = 0;
    if (!again)
        forEnds<Rules>(args, segments, first, work.segments, wanted, [&](uint32_t) { ++ends; });
    if (ends != 0) {
        if (lead)
            state.done = 0u - ends;
        forEnds<Rules>(args, segments, first, work.segments, wanted, [&](uint32_t s) {
            if (lead)
                queue.push(1, [&](uint32_t) { return segmentItem<T>(work, s) | SegmentQueue::kAgain; });
        });
    } else if (wanted) {
        forPixels<T>(place, [&](uint32_t, uint32_t i, uint32_t x, uint32_t y) {
            const SegmentPixel pixel = joined<Rules>(args, segments, first, work.segments, i);
            endPixel<Rules>(args, area.eye, area.bin_x + x, area.bin_y + y, pixel.transmittance, pixel.color,
                            args.pass.index + 1 == args.pass.count);
        });
    }
}

// Returns the light with which a pixel starts in a segment that is not the first, -1 if the pixel needs nothing of the
// segment, and sets `least`, the light at which the pixel is done.
template <typename Rules, typename T>
__device__ __forceinline__ float beginSegment(const BlendCudaArgs& args, const LonePair& work, uint32_t i, float& least)
{
    const SegmentsOfTile<T> segments(args, work.list(), 2 * work.pair + halfOfWarp());
    float light = 0;
    if (work.way == SegmentWay::Again)
        light = lightThatEnds<Rules>(args, segments, __ldcg(&stateOf<T>(args, work).first), work.segment(), i);
    else
        light = segments.transmittance(0, i);
    if (!Rules::takesLight(light, args.lifted_stop))
        return -1.0f;
    // a segment blended apart takes the light that reaches the first such segment, and a bound lowered by more than its
    // rounding: the bound of a pixel with less light must not be below it
    least = leastOf<Rules>(args, light) * (work.way == SegmentWay::Apart ? 1 - 0x1p-16f : 1.0f);
    return Rules::kWhole;
}

// Blends the work of a warp. more: the list has further units behind these; sub-tiles that still take light are then
// marked in `unfinished` for a later launch. Returns true if the same warp must blend the next segment.
template <typename Rules, typename T>
__device__ __forceinline__ bool blendPair(const BlendCudaArgs& args, const LonePair& work, const Area& area, bool more,
                                          const SegmentQueue& queue, LoneShared<Rules>& shared, uint32_t& evaluations)
{
    const uint32_t left = 2 * work.pair;
    const PairPlace place{left / T::kBinColumns, left % T::kBinColumns};
    const bool wanted = (work.wanted >> halfOfWarp() & 1u) != 0;
    const bool later = work.way != SegmentWay::Whole && work.segment() != 0;
    T tile;
    float least[2] = {args.lifted_stop, args.lifted_stop};
    forPixels<T>(place, [&](uint32_t, uint32_t i, uint32_t x, uint32_t y) {
        Begun begun{-1.0f, {0, 0, 0}};
        if (wanted && !later)
            begun = begunPixel<Rules>(args, area.eye, area.bin_x + x, area.bin_y + y,
                                      work.from != 0 || args.pass.index != 0);
        if constexpr (Rules::kSegments)
            if (wanted && later)
                begun.transmittance = beginSegment<Rules, T>(args, work, i, least[i]);
        tile.transmittance[0][i] = begun.transmittance;
        for (int c = 0; c < 3; ++c)
            tile.color[0][i][c] = begun.color[c];
    });
    const bool open = blendTile<Rules, T>(args, area, work.first_unit + work.from, work.to - work.from, place, least,
                                          tile, shared, evaluations);
    if constexpr (Rules::kSegments) {
        if (work.way == SegmentWay::InTurn)
            return endInTurn<Rules>(args, work, area, place, wanted, queue, tile);
        if (work.way != SegmentWay::Whole) {
            endApart<Rules>(args, work, area, place, wanted, queue, tile);
            return false;
        }
    }
    const bool left_open = more && open;
    if (wanted)
        forPixels<T>(place, [&](uint32_t, uint32_t i, uint32_t x, uint32_t y) {
            endPixel<Rules>(args, area.eye, area.bin_x + x, area.bin_y + y, tile.transmittance[0][i], tile.color[0][i],
                            !left_open && args.pass.index + 1 == args.pass.count);
        });
    const uint32_t open_halves = halvesThat(left_open);
    if (more && (threadIdx.x & 31u) == 0)
        atomicOr(&unfinishedOf(args, work.bin.entry, work.bin.eye), open_halves << left);
    return false;
}

// Blends long lists; each warp takes one pair of sub-tiles after another.
template <typename Rules, uint32_t kRows>
__global__ void __launch_bounds__(kLoneThreads, Rules::kLoneBlocks)
    tileKernel(const __grid_constant__ BlendCudaArgs args, LongPart part)
{
    launchDependents(); // the blocks of the next kernel may start on multiprocessors that this one leaves idle
    PassCounters& pass = args.counters->pass;
    const uint32_t readers = args.shared_bins ? kMaxEyes : 1u, longest = readers * pass.longest_bins;
    const uint32_t bins = part == LongPart::First && longest != 0 ? longest : readers * pass.long_bins;
    if (bins == 0 || (part == LongPart::Behind && longest == 0) || willRepeat(*args.counters))
        return;
    using T = LoneTile<kRows>;
    __shared__ LoneShared<Rules> shared[kLoneThreads / kHalf];
    const uint32_t lane = threadIdx.x & 31u;
    // order of the work: the first segments, then the other lists, then the queue
    uint32_t segment_pairs = 0, first_bin = 0;
    if constexpr (Rules::kSegments)
        if (part == LongPart::Behind) {
            segment_pairs = pass.segment_pairs;
            first_bin = longest;
        }
    const uint32_t pairs = segment_pairs + (bins - first_bin) * T::kBinPairs;
    static_assert(!Rules::kSegments || Rules::kLoneBlocks * kLoneThreads == 32 * kLoneWarps);
    const SegmentQueue queue{pass, args.segment_queue, gridDim.x * (kLoneThreads / 32)};
    uint32_t evaluations[kMaxEyes] = {};
    while (true) {
        uint32_t next = 0, item = SegmentQueue::kNone;
        if (lane == 0) {
            next = atomicAdd(&pass.next_tile[uint32_t(part)], 1u);
            if (next < segment_pairs)
                item = args.segment_pairs[next];
            else if (next >= pairs && segment_pairs != 0)
                item = queue.take();
        }
        next = __shfl_sync(~0u, next, 0);
        item = __shfl_sync(~0u, item, 0);
        __syncwarp(); // from here on all lanes see the writes that lane 0 waited for
        LonePair work{};
        if (item != SegmentQueue::kNone) {
            work.way = next < segment_pairs                 ? SegmentWay::InTurn
                       : (item & SegmentQueue::kAgain) == 0 ? SegmentWay::Apart
                                                            : SegmentWay::Again;
            const uint32_t pair = item & ~SegmentQueue::kAgain;
            const TouchUnit& unit = args.touch_units[pair / T::kBinPairs];
            work.bin = {unit.entry, unit.eye};
            work.pair = pair % T::kBinPairs;
            work.from = unit.number;
        } else if (next < pairs) {
            const uint32_t pair = next - segment_pairs, i = first_bin + pair / T::kBinPairs;
            work.bin = binAt(args, i);
            work.pair = pair % T::kBinPairs;
            work.from = part == LongPart::Behind && i < longest ? kFirstUnits : 0u;
        } else {
            break;
        }
        const auto unfinished = [&]() -> uint32_t& { return unfinishedOf(args, work.bin.entry, work.bin.eye); };
        work.wanted = work.from != 0 ? unfinished() >> 2 * work.pair & 3u : 3u;
        Area area{};
        // such a pair has no listed segments, so queue.finish() is not needed
        if (!areaOf<T>(args, work.bin, area) || work.wanted == 0)
            continue;
        const uint32_t all = (area.end - area.begin + kTouchUnit - 1) / kTouchUnit;
        work.first_unit = args.bin_units[work.bin.entry] + (args.shared_bins ? work.bin.eye * all : 0u);
        const bool first_only = part == LongPart::First || (part == LongPart::All && unfinished() == 0);
        work.to = first_only ? min(all, kFirstUnits) : all;
        if (item != SegmentQueue::kNone) {
            work.segments = (all - kFirstUnits + kSegmentUnits - 1) / kSegmentUnits;
            work.to = min(all, work.from + kSegmentUnits);
        }
        area.begin += work.from * kTouchUnit;
        uint32_t seen = 0; // number of splats that this half of the warp has blended
        while (blendPair<Rules, T>(args, work, area, part == LongPart::First && work.to != all, queue,
                                   shared[threadIdx.x / kHalf], seen)) {
            area.begin += kSegmentUnits * kTouchUnit;
            work.from = work.to;
            work.to = min(all, work.from + kSegmentUnits);
        }
        if (item != SegmentQueue::kNone)
            queue.finish(segment_pairs);
        seen += __shfl_xor_sync(~0u, seen, int(kHalf));
        evaluations[0] += work.bin.eye == 0 ? seen : 0u;
        evaluations[1] += work.bin.eye == 0 ? 0u : seen;
    }
    if constexpr (!Rules::kDepth)
        countEvaluations(args, evaluations);
}

} // namespace gsc
