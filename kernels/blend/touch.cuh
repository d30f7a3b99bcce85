// SPDX-License-Identifier: Apache-2.0
// Long lists: which sub-tiles every key's splat touches, found by the whole device before those are blended. Then a warp
// blends each sub-tile by itself and reads nothing that does not touch it.
#pragma once

#include "kernels/blend/blend_cuda.h"
#include "kernels/blend/blend_rules.cuh"
#include "kernels/cuda/launch.cuh"

namespace gsc {

constexpr uint32_t kTouchThreads = 256;
template <typename Rules>
constexpr uint32_t kTouchBlocks = Rules::kCodes ? 4 : 3; // of a multiprocessor
constexpr uint32_t kWarpKeys = kTouchUnit / (kTouchThreads / 32);
constexpr uint32_t kUnitWords = kTouchUnit / 32; // of a sub-tile
static_assert(kWarpKeys == 256);                 // a warp writes two vectors of four words for each sub-tile

// The sub-tiles of a bin that warps blend by themselves. Narrow: far splats crowd in a few rows of pixels, and this spreads
// a row over many warps.
template <uint32_t kRows>
using LoneTile = Tile<4, 8 * kRows, 1, 1>;

// A unit's bits: planes of the bin's sub-tiles, then of its rows of pixels. Bit b of a plane's word w tells whether the
// splat of key 32 w + b touches that sub-tile or row.
template <typename T>
struct TouchPlanes {
    static constexpr uint32_t kSubTiles = T::kBinRows * T::kBinColumns, kRows = T::kBinRows * T::kHeight;
    static constexpr uint32_t kAll = kSubTiles + kRows;

    static __device__ __forceinline__ uint32_t* words(const BlendCudaArgs& args, uint32_t unit, uint32_t plane)
    {
        return args.touch + (size_t(unit) * kAll + plane) * kUnitWords;
    }
};

// Bit per row that lies within `extent` of `top`; both in pixels, from the first of at most 32 rows.
__device__ __forceinline__ uint32_t rowMask(float top, float extent, uint32_t rows)
{
    const int first = max(__float2int_ru(top - extent), 0), last = min(__float2int_rd(top + extent), int(rows) - 1);
    return first <= last ? (2u << last) - (1u << first) : 0u;
}

// Bit i of lane j to bit j of lane i, of kCount words by themselves, so that their shuffles do not wait for each other.
template <uint32_t kCount>
__device__ __forceinline__ void transposeBits(uint32_t (&words)[kCount])
{
    const uint32_t lane = threadIdx.x & 31u;
    uint32_t low = 0x0000ffffu; // the bits that a lane of the lower half of its group keeps
#pragma unroll
    for (uint32_t half = 16; half != 0; half /= 2, low ^= low << half) {
        uint32_t others[kCount];
#pragma unroll
        for (uint32_t i = 0; i < kCount; ++i)
            others[i] = __shfl_xor_sync(~0u, words[i], int(half));
#pragma unroll
        for (uint32_t i = 0; i < kCount; ++i)
            words[i] = (lane & half) == 0 ? (words[i] & low) | (others[i] & low) << half
                                          : (words[i] & ~low) | (others[i] & ~low) >> half;
    }
}

// What a small splat touches of a bin, as touchKernel() has it.
struct Touched {
    uint32_t sub_tiles, rows;
};

// A bin in the image of an eye.
struct TouchBin {
    uint32_t column, y; // in bins, in pixels
};

// code: touchCode(), not kTouchUnknown.
template <typename T>
__device__ __forceinline__ Touched touchedBy(uint32_t code, const TouchBin& bin)
{
    constexpr uint32_t kColumns = T::kBinColumns, kRows = T::kBinRows * T::kHeight;
    static_assert(T::kWidth == kTouchColumn && 2 * kColumns == 16 && 2 * kRows <= 64);
    // from the bin's first, or before it
    const int left = int((code - bin.column * kColumns) << 28) >> 28, top = int(((code >> 6) - bin.y) << 26) >> 26;
    const int right = min(left + int(code >> 4 & 3u), int(kColumns) - 1);
    const int bottom = min(top + int(code >> 12), int(kRows) - 1);
    const uint32_t columns = right < 0 ? 0u : (2u << right) - (1u << max(left, 0));
    const uint32_t rows = max(top, 0) > bottom ? 0u : (2u << bottom) - (1u << max(top, 0));
    uint32_t sub_tiles = 0;
#pragma unroll
    for (uint32_t row = 0; row < T::kBinRows; ++row)
        if ((rows >> row * T::kHeight & ((1u << T::kHeight) - 1u)) != 0)
            sub_tiles |= columns << row * kColumns;
    return {sub_tiles, rows};
}

// Which of unfinished: `entry` as eye `eye` draws it.
__device__ __forceinline__ uint32_t& unfinishedOf(const BlendCudaArgs& args, uint32_t entry, uint32_t eye)
{
    return args.unfinished[entry + (args.shared_bins ? eye * args.grid.bins() : 0u)];
}

// Words of a key: its sub-tiles, then its rows; in one where both have room.
template <typename T>
constexpr uint32_t kTouchWords = (TouchPlanes<T>::kAll + 31) / 32;
template <typename T>
constexpr bool kTwoWords = TouchPlanes<T>::kAll > 32;

template <typename T>
__device__ __forceinline__ uint32_t firstWord(const Touched& touched)
{
    return kTwoWords<T> ? touched.sub_tiles : touched.sub_tiles | touched.rows << 16;
}

template <typename Rules, typename T>
__device__ __forceinline__ Touched touchedBy(const typename Rules::Splat& splat, const RasterConstants& rules,
                                             const TouchBin& bin)
{
    const auto x0 = float(bin.column * kBinWidth), y0 = float(bin.y);
    const Bounds bounds = Rules::bounds(splat);
    return {subTileMask<T>(bounds, Rules::box(splat, rules), splat.x, splat.y, x0, y0),
            rowMask(splat.y - y0, bounds.extent_y, TouchPlanes<T>::kRows)};
}

// Of each warp: slots of splats that have no code, then what they touch.
template <typename T>
struct TouchShared {
    uint32_t unknown[kTouchThreads / 32][kWarpKeys];
    uint32_t rows[kTouchThreads / 32][kTwoWords<T> ? kWarpKeys : 1];
};

// What a lane's keys of a unit touch, of which it has every 32nd from the warp's first on. Every splat is fetched, all before
// the first is looked at.
template <typename Rules, typename T, uint32_t kCount>
__device__ __forceinline__ void touchOfSplats(const uint32_t (&slots)[kCount], const typename Rules::Splat* splats,
                                              const RasterConstants& rules, const TouchBin& bin,
                                              uint32_t (&words)[kTouchWords<T>][kCount])
{
    typename Rules::Splat fetched[kCount];
#pragma unroll
    for (uint32_t i = 0; i < kCount; ++i)
        fetched[i] = splats[slots[i]];
#pragma unroll
    for (uint32_t i = 0; i < kCount; ++i) {
        const Touched touched = touchedBy<Rules, T>(fetched[i], rules, bin);
        words[0][i] = firstWord<T>(touched);
        if constexpr (kTwoWords<T>)
            words[kTouchWords<T> - 1][i] = touched.rows;
    }
}

// The same by codes. Those that have none are looked at together. keys: of the unit, `first` the lane's.
template <typename Rules, typename T, uint32_t kCount>
__device__ __forceinline__ void touchOfCodes(const uint32_t (&slots)[kCount], const uint32_t (&codes)[kCount],
                                             uint32_t first, uint32_t keys, const typename Rules::Splat* splats,
                                             const RasterConstants& rules, const TouchBin& bin, TouchShared<T>& shared,
                                             uint32_t (&words)[kTouchWords<T>][kCount])
{
    const uint32_t warp = threadIdx.x / 32, lane = threadIdx.x & 31u;
    uint32_t* const unknown = shared.unknown[warp];
    uint32_t places[kCount], count = 0; // of those without a code
    __syncwarp();                       // the last unit's are read
#pragma unroll
    for (uint32_t i = 0; i < kCount; ++i) {
        const bool looks = first + 32 * i < keys && codes[i] == kTouchUnknown;
        const uint32_t looking = __ballot_sync(~0u, looks);
        places[i] = looks ? count + __popc(looking & ((1u << lane) - 1u)) : ~0u;
        if (looks)
            unknown[places[i]] = slots[i];
        count += uint32_t(__popc(looking));
    }
    __syncwarp();
    for (uint32_t i = lane; i < count; i += 32) {
        const Touched touched = touchedBy<Rules, T>(splats[unknown[i]], rules, bin);
        unknown[i] = firstWord<T>(touched);
        if constexpr (kTwoWords<T>)
            shared.rows[warp][i] = touched.rows;
    }
    __syncwarp();
#pragma unroll
    for (uint32_t i = 0; i < kCount; ++i) {
        const Touched touched = touchedBy<T>(codes[i], bin);
        words[0][i] = places[i] != ~0u ? unknown[places[i]] : firstWord<T>(touched);
        if constexpr (kTwoWords<T>)
            words[kTouchWords<T> - 1][i] = places[i] != ~0u ? shared.rows[warp][places[i]] : touched.rows;
    }
}

// A block takes a unit. behind: not the first of each list, but those behind them that some sub-tile needs.
template <typename Rules, uint32_t kRows>
__global__ void __launch_bounds__(kTouchThreads, kTouchBlocks<Rules>)
    touchKernel(const __grid_constant__ BlendCudaArgs args, bool behind)
{
    using T = LoneTile<kRows>;
    using Splat = typename Rules::Splat;
    using Planes = TouchPlanes<T>;
    constexpr uint32_t kAtOnce = kWarpKeys / 32, kWords = kTouchWords<T>;
    if (willRepeat(*args.counters))
        return;
    const uint32_t warp = threadIdx.x / 32, lane = threadIdx.x & 31u;
    for (uint32_t u = blockIdx.x; u < args.counters->pass.touch_units; u += gridDim.x) {
        const TouchUnit unit = args.touch_units[u];
        if (behind != (unit.number >= kFirstUnits) || (behind && unfinishedOf(args, unit.entry, unit.eye) == 0))
            continue;
        const uint32_t bin = unit.entry < args.grid.bins() ? unit.entry : unit.entry - args.grid.bins();
        const uint32_t eye_column = bin % args.grid.columns - (unit.eye == 0 ? args.grid.shift[0] : args.grid.shift[1]);
        const uint32_t bin_y = bin / args.grid.columns * (8 * kRows);
        if (eye_column >= args.grid.columns || !args.lens[unit.eye].shows(eye_column, bin_y / kLensSquare))
            continue; // as areaOf() has it
        const Splat* splats =
            static_cast<const Splat*>(args.splats) + (args.shared_bins ? unit.eye * args.slot_capacity : 0u);
        const uint32_t first = warp * kWarpKeys + lane;
        const TouchBin place{eye_column, bin_y};
        uint32_t slots[kAtOnce], words[kWords][kAtOnce];
#pragma unroll
        for (uint32_t i = 0; i < kAtOnce; ++i)
            slots[i] = args.keys[unit.first + min(first + 32 * i, unit.count - 1)].slot;
        if constexpr (Rules::kCodes) {
            __shared__ TouchShared<T> shared;
            uint32_t codes[kAtOnce];
#pragma unroll
            for (uint32_t i = 0; i < kAtOnce; ++i)
                codes[i] = args.touches == nullptr ? kTouchUnknown
                                                   : args.touches[touchPlace(args.shared_bins, unit.eye, slots[i])];
            touchOfCodes<Rules, T>(slots, codes, first, unit.count, splats, args.rules, place, shared, words);
        } else {
            touchOfSplats<Rules, T>(slots, splats, args.rules, place, words);
        }
#pragma unroll
        for (uint32_t i = 0; i < kAtOnce; ++i)
            if (first + 32 * i >= unit.count)
                words[0][i] = 0;
#pragma unroll
        for (uint32_t w = 0; w < kWords; ++w) {
            transposeBits(words[w]);
            auto* to = reinterpret_cast<uint4*>(Planes::words(args, u, 32 * w + lane) + warp * kAtOnce);
#pragma unroll
            for (uint32_t i = 0; i < kAtOnce / 4; ++i)
                to[i] = {words[w][4 * i], words[w][4 * i + 1], words[w][4 * i + 2], words[w][4 * i + 3]};
        }
    }
}

// The keys of a list that touch a sub-tile, from near to far. A lane holds the bits of 64 keys of the unit. All members: the
// whole warp together.
template <typename T>
class TouchReader {
public:
    // open: bit per pixel of the sub-tile that takes light.
    __device__ __forceinline__ TouchReader(const BlendCudaArgs& args, uint32_t first_unit, uint32_t units,
                                           uint32_t sub_tile, uint32_t open)
        : words_(reinterpret_cast<const uint2*>(Planes::words(args, first_unit, sub_tile)) + (threadIdx.x & 31u)),
          rows_(reinterpret_cast<const uint2*>(
                    Planes::words(args, first_unit, Planes::kSubTiles + sub_tile / T::kBinColumns * T::kHeight)) +
                (threadIdx.x & 31u)),
          units_(units)
    {
        ahead_ = load(0, open);
    }

    // How many there are, up to 32. key: of so many lanes, the place in the list. 0: no more.
    __device__ __forceinline__ uint32_t next(uint32_t& key, uint32_t open)
    {
        while (taken_ == total_) {
            if (unit_ == units_)
                return 0;
            begin(open);
        }
        const uint32_t some = min(32u, total_ - taken_);
        key = place(taken_ + (threadIdx.x & 31u));
        taken_ += some;
        return some;
    }

private:
    using Planes = TouchPlanes<T>;

    // The lane's bits of a unit. Keys that touch only rows that are finished are left out.
    __device__ __forceinline__ uint2 load(uint32_t unit, uint32_t open) const
    {
        constexpr uint32_t kStep = Planes::kAll * kUnitWords / 2, kRow = (1u << T::kWidth) - 1u;
        static_assert(T::kWidth * T::kHeight == 32);
        uint2 bits = words_[size_t(unit) * kStep];
        if (open == ~0u)
            return bits;
        uint2 rows{};
#pragma unroll
        for (uint32_t row = 0; row < T::kHeight; ++row)
            if ((open >> row * T::kWidth & kRow) != 0) {
                const uint2 some = rows_[size_t(unit) * kStep + row * (kUnitWords / 2)];
                rows.x |= some.x;
                rows.y |= some.y;
            }
        return {bits.x & rows.x, bits.y & rows.y};
    }

    // Of the set bit of the unit before which there are `rank` others.
    __device__ __forceinline__ uint32_t place(uint32_t rank) const
    {
        uint32_t owner = 0; // the last lane before whose bits there are no more than that
#pragma unroll
        for (uint32_t step = 16; step != 0; step /= 2)
            if (__shfl_sync(~0u, before_, int(owner + step)) <= rank)
                owner += step;
        rank -= __shfl_sync(~0u, before_, int(owner));
        const uint32_t near = __shfl_sync(~0u, now_.x, int(owner)), far = __shfl_sync(~0u, now_.y, int(owner));
        const auto of_near = uint32_t(__popc(near));
        const bool beyond = rank >= of_near;
        return (unit_ - 1) * kTouchUnit + 64 * owner + (beyond ? 32 : 0) +
               bitOfRank(beyond ? far : near, beyond ? rank - of_near : rank);
    }

    // Where the set bit is before which there are `rank` others.
    static __device__ __forceinline__ uint32_t bitOfRank(uint32_t word, uint32_t rank)
    {
        uint32_t at = 0;
#pragma unroll
        for (uint32_t width = 16; width != 0; width /= 2) {
            const auto below = uint32_t(__popc(word >> at & ((1u << width) - 1u)));
            if (rank >= below) {
                rank -= below;
                at += width;
            }
        }
        return at;
    }

    __device__ __forceinline__ void begin(uint32_t open)
    {
        const uint32_t lane = threadIdx.x & 31u;
        now_ = ahead_;
        ++unit_;
        if (unit_ < units_)
            ahead_ = load(unit_, open);
        const auto own = uint32_t(__popc(now_.x) + __popc(now_.y));
        uint32_t sum = own;
#pragma unroll
        for (uint32_t step = 1; step < 32; step *= 2) {
            const uint32_t left = __shfl_sync(~0u, sum, int(lane >= step ? lane - step : lane));
            sum += lane >= step ? left : 0u;
        }
        before_ = sum - own;
        total_ = __shfl_sync(~0u, sum, 31);
        taken_ = 0;
    }

    const uint2 *words_, *rows_;
    uint2 now_{}, ahead_;
    uint32_t units_, unit_ = 0, before_ = 0, total_ = 0, taken_ = 0;
};

} // namespace gsc
