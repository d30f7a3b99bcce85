// SPDX-License-Identifier: Apache-2.0
// Prepares long lists for blending: the whole device finds which sub-tiles and rows of pixels each splat touches.
#pragma once

#include "kernels/blend/cuda/bins.cuh"
#include "kernels/cuda/launch.cuh"

namespace gsc {

constexpr uint32_t kTouchThreads = 256;
template <typename Rules>
constexpr uint32_t kTouchBlocks = Rules::kCodes ? 4 : 3; // blocks that run on a multiprocessor at once
constexpr uint32_t kWarpKeys = kTouchUnit / (kTouchThreads / 32);
constexpr uint32_t kUnitWords = kTouchUnit / 32; // words of bits for each unit and sub-tile
static_assert(kWarpKeys == 256);                 // so that a warp writes two vectors of four words for each sub-tile

// Sub-tiles of a bin for long lists, of which half a warp blends one by itself. They are narrow, 4 pixels wide: far
// splats crowd in a few rows of pixels, which are so shared among many warps.
template <uint32_t kRows>
using LoneTile = Tile<4, 8 * kRows, 1>;

// Bits of a unit, in planes: one for each sub-tile of the bin, then one for each of its rows of pixels. Bit b of word w
// of a plane tells whether the splat of key 32 w + b touches that sub-tile or row.
template <typename T>
struct TouchPlanes {
    static constexpr uint32_t kSubTiles = T::kBinRows * T::kBinColumns, kRows = T::kBinRows * T::kHeight;
    static constexpr uint32_t kAll = kSubTiles + kRows;

    static __device__ __forceinline__ uint32_t* words(const BlendCudaArgs& args, uint32_t unit, uint32_t plane)
    {
        return args.touch + (size_t(unit) * kAll + plane) * kUnitWords;
    }
};

// A bit per row of pixels that lies within `extent` of `top`; both are in pixels, from the first of at most 32 rows.
__device__ __forceinline__ uint32_t rowMask(float top, float extent, uint32_t rows)
{
    const int first = max(__float2int_ru(top - extent), 0), last = min(__float2int_rd(top + extent), int(rows) - 1);
    return first <= last ? (2u << last) - (1u << first) : 0u;
}

// Exchanges words with the lane whose number differs in the bit `with`, and returns that lane's words.
template <uint32_t kCount>
__device__ __forceinline__ void wordsAcross(const uint32_t (&words)[kCount], uint32_t with, uint32_t (&others)[kCount])
{
#pragma unroll
    for (uint32_t i = 0; i < kCount; ++i)
        others[i] = __shfl_xor_sync(~0u, words[i], int(with));
}

// Transposes bits in a warp: bit i of lane j goes to bit j of lane i. Does so for each of kCount words, side by side,
// so that their shuffles do not wait for each other.
template <uint32_t kCount>
__device__ __forceinline__ void transposeBits(uint32_t (&words)[kCount])
{
    const uint32_t lane = threadIdx.x & 31u;
    // first exchanges halves and bytes of words, for which a permutation of bytes is enough
#pragma unroll
    for (uint32_t half = 16; half >= 8; half /= 2) {
        const uint32_t pick =
            half == 16 ? ((lane & half) == 0 ? 0x5410u : 0x3276u) : ((lane & half) == 0 ? 0x6240u : 0x3715u);
        uint32_t others[kCount];
        wordsAcross(words, half, others);
#pragma unroll
        for (uint32_t i = 0; i < kCount; ++i)
            words[i] = __byte_perm(words[i], others[i], pick);
    }
    uint32_t low = 0x0f0f0f0fu; // bits that a lane keeps if it is in the lower half of its group
#pragma unroll
    for (uint32_t half = 4; half != 0; half /= 2, low ^= low << half) {
        const uint32_t keeps = (lane & half) == 0 ? low : ~low, turn = (lane & half) == 0 ? half : 32 - half;
        uint32_t others[kCount];
        wordsAcross(words, half, others);
#pragma unroll
        for (uint32_t i = 0; i < kCount; ++i)
            words[i] = (words[i] & keeps) | (__funnelshift_l(others[i], others[i], turn) & ~keeps);
    }
}

// Sub-tiles and rows of a bin that a splat touches, a bit each, as touchKernel() stores them.
struct Touched {
    uint32_t sub_tiles, rows;
};

// Place of a bin in the image of an eye.
struct TouchBin {
    uint32_t column, y; // column in bins, y in pixels
};

// Decodes touchCode() of a splat for a bin. Precondition: the code is not kTouchUnknown.
template <typename T>
__device__ __forceinline__ Touched touchedBy(uint32_t code, const TouchBin& bin)
{
    constexpr uint32_t kColumns = T::kBinColumns, kRows = T::kBinRows * T::kHeight;
    static_assert(T::kWidth == kTouchColumn && 2 * kColumns == 16 && 2 * kRows <= 64);
    // counted from one bin's columns, or 32 rows, before the bin: bits outside of the bin are shifted out
    const uint32_t left = (code - bin.column * kColumns + kColumns) & 15u, top = ((code >> 6) - bin.y + 32u) & 63u;
    const uint32_t columns = ((2u << (code >> 4 & 3u)) - 1u) << left >> kColumns & ((1u << kColumns) - 1u);
    const uint32_t rows =
        uint32_t(uint64_t((2u << (code >> 12)) - 1u) << top >> 32) & uint32_t((uint64_t(1) << kRows) - 1u);
    uint32_t sub_tiles = 0;
#pragma unroll
    for (uint32_t row = 0; row < T::kBinRows; ++row)
        if ((rows >> row * T::kHeight & ((1u << T::kHeight) - 1u)) != 0)
            sub_tiles |= columns << row * kColumns;
    return {sub_tiles, rows};
}

// Words for the bits of a key: sub-tiles, then rows; a single word if it has room for both.
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

// Shared memory of each warp: slots of its splats without a code, then the pixels that these touch.
template <typename T>
struct TouchShared {
    uint32_t unknown[kTouchThreads / 32][kWarpKeys];
    uint32_t rows[kTouchThreads / 32][kTwoWords<T> ? kWarpKeys : 1];
};

// Finds the pixels that the keys of a lane touch in a unit; the lane has every 32nd key from the warp's first on.
// Fetches every splat, and all before it looks at the first.
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

// Finds the pixels that the keys of a lane touch, from the codes of their splats. The lanes of a warp together fetch
// the splats that have no code. keys: number in the unit; first: the lane's first key.
template <typename Rules, typename T, uint32_t kCount>
__device__ __forceinline__ void touchOfCodes(const uint32_t (&slots)[kCount], const uint32_t (&codes)[kCount],
                                             uint32_t first, uint32_t keys, const typename Rules::Splat* splats,
                                             const RasterConstants& rules, const TouchBin& bin, TouchShared<T>& shared,
                                             uint32_t (&words)[kTouchWords<T>][kCount])
{
    const uint32_t warp = threadIdx.x / 32, lane = threadIdx.x & 31u;
    uint32_t* const unknown = shared.unknown[warp];
    uint32_t places[kCount], count = 0; // places: keys of this lane whose splats have no code; count: their number
    __syncwarp();                       // waits before the memory of the last unit is written again
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
    const auto look = [&](uint32_t i, const typename Rules::Splat& splat) {
        const Touched touched = touchedBy<Rules, T>(splat, rules, bin);
        unknown[i] = firstWord<T>(touched);
        if constexpr (kTwoWords<T>)
            shared.rows[warp][i] = touched.rows;
    };
    for (uint32_t i = lane; i < count; i += 64) { // a lane fetches two splats at once
        const bool two = i + 32 < count;
        const typename Rules::Splat first_splat = splats[unknown[i]], second = splats[unknown[two ? i + 32 : i]];
        look(i, first_splat);
        if (two)
            look(i + 32, second);
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

// Empties the queue of segments. The blocks of the whole grid share the work.
template <typename T>
__device__ __forceinline__ void clearQueue(const BlendCudaArgs& args, uint32_t processors)
{
    const uint32_t words =
        2 * T::kBinPairs * (args.counters->pass.touch_units / kSegmentUnits + 1) + kLoneWarps * processors;
    for (uint32_t i = blockIdx.x * kTouchThreads + threadIdx.x; i < words; i += gridDim.x * kTouchThreads)
        args.segment_queue[i] = 0;
}

// Lists, for every pair of sub-tiles that still takes light, the first segment behind the first units of a list. u:
// first unit of that segment.
template <typename T>
__device__ __forceinline__ void listSegments(const BlendCudaArgs& args, uint32_t u, uint32_t unfinished)
{
    uint32_t pairs = (unfinished | unfinished >> 1) & 0x55555555u;
    uint32_t at = atomicAdd(&args.counters->pass.segment_pairs, uint32_t(__popc(int(pairs))));
    for (; pairs != 0; pairs &= pairs - 1) {
        const uint32_t pair = uint32_t(__ffs(int(pairs)) - 1) / 2;
        args.segment_pairs[at++] = u * T::kBinPairs + pair;
    }
}

// Finds for each unit which sub-tiles and rows its splats touch; a block takes a unit. behind: false for the first
// units of each list, true for those behind them in lists that some sub-tile still needs.
template <typename Rules, uint32_t kRows>
__global__ void __launch_bounds__(kTouchThreads, kTouchBlocks<Rules>)
    touchKernel(const __grid_constant__ BlendCudaArgs args, bool behind)
{
    using T = LoneTile<kRows>;
    using Splat = typename Rules::Splat;
    using Planes = TouchPlanes<T>;
    constexpr uint32_t kAtOnce = kWarpKeys / 32, kWords = kTouchWords<T>;
    if ((behind && args.counters->pass.longest_bins == 0) || willRepeat(*args.counters))
        return;
    if constexpr (Rules::kSegments)
        if (behind)
            clearQueue<T>(args, gridDim.x / kTouchBlocks<Rules>);
    const uint32_t warp = threadIdx.x / 32, lane = threadIdx.x & 31u;
    for (uint32_t u = blockIdx.x; u < args.counters->pass.touch_units; u += gridDim.x) {
        const TouchUnit unit = args.touch_units[u];
        if (behind != (unit.number >= kFirstUnits) || (behind && unfinishedOf(args, unit.entry, unit.eye) == 0))
            continue;
        const uint32_t bin = unit.entry < args.grid.bins() ? unit.entry : unit.entry - args.grid.bins();
        const uint32_t eye_column = bin % args.grid.columns - (unit.eye == 0 ? args.grid.shift[0] : args.grid.shift[1]);
        const uint32_t bin_y = bin / args.grid.columns * (8 * kRows);
        if (eye_column >= args.grid.columns || !args.lens[unit.eye].shows(eye_column, bin_y / kLensSquare))
            continue; // the bin is not drawn, as areaOf() decides
        if constexpr (Rules::kSegments)
            if (behind && unit.number == kFirstUnits && threadIdx.x == 0)
                listSegments<T>(args, u, unfinishedOf(args, unit.entry, unit.eye));
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

// keys of a part of a unit: half a warp holds the bits of a part, one word in each lane
constexpr uint32_t kPartKeys = 32 * kHalf;

// Reads the keys of a list that touch a sub-tile, from near to far. Each half of a warp has a sub-tile of its own. It
// holds the bits of one part of the units, and writes them out as places of keys. All lanes of the warp call the
// members together.
template <typename T>
class TouchReader {
public:
    // Begins to read for the sub-tile of this half. open: a bit for each lane of the half, set if one of the lane's
    // pixels takes light; places: room for kPartKeys in shared memory, used by this half alone.
    __device__ __forceinline__ TouchReader(const BlendCudaArgs& args, uint32_t first_unit, uint32_t units,
                                           uint32_t sub_tile, uint32_t open, uint16_t* places)
        : words_(Planes::words(args, first_unit, sub_tile) + threadIdx.x % kHalf),
          rows_(Planes::words(args, first_unit, Planes::kSubTiles + sub_tile / T::kBinColumns * T::kHeight) +
                threadIdx.x % kHalf),
          places_(places), parts_(open != 0 ? kParts * units : 0)
    {
        ahead_ = parts_ != 0 ? load(0, open) : 0u;
    }

    // Returns the number of keys that follow for this half, up to kHalf; 0 if there are none. key: in that many first
    // lanes, the place of the key in the list.
    __device__ __forceinline__ uint32_t next(uint32_t& key, uint32_t open)
    {
        const uint32_t lane = threadIdx.x % kHalf;
        uint32_t have = 0;
        while (true) {
            const uint32_t some = min(kHalf - have, total_ - taken_);
            if (lane - have < some)
                key = (part_ - 1) * kPartKeys + places_[taken_ + lane - have];
            have += some;
            taken_ += some;
            const bool wants = have < kHalf && part_ < parts_;
            if (!__any_sync(~0u, wants))
                return have;
            begin(wants, open);
        }
    }

    __device__ __forceinline__ void stop() // to be called if this half of the warp needs no more keys
    {
        parts_ = part_;
        taken_ = total_;
    }

private:
    using Planes = TouchPlanes<T>;
    static constexpr uint32_t kParts = kTouchUnit / kPartKeys;

    // Bits of this lane in a part. Keys that touch only rows without light are left out.
    __device__ __forceinline__ uint32_t load(uint32_t part, uint32_t open) const
    {
        constexpr uint32_t kStep = Planes::kAll * kUnitWords, kRow = (1u << T::kLaneWidth) - 1u;
        static_assert(T::kLaneWidth * T::kHeight == kHalf && kUnitWords == kParts * kHalf);
        const size_t at = size_t(part / kParts) * kStep + part % kParts * kHalf;
        if (open == kHalfMask)
            return words_[at];
        uint32_t rows = 0;
#pragma unroll
        for (uint32_t row = 0; row < T::kHeight; ++row)
            if ((open >> row * T::kLaneWidth & kRow) != 0)
                rows |= rows_[at + row * kUnitWords];
        return words_[at] & rows;
    }

    // Begins the next part in each half that wants one.
    __device__ __forceinline__ void begin(bool wants, uint32_t open)
    {
        const uint32_t lane = threadIdx.x % kHalf;
        uint32_t bits = wants ? ahead_ : 0u;
        if (wants && ++part_ < parts_)
            ahead_ = load(part_, open);
        auto sum = uint32_t(__popc(bits)); // set bits of the half's lanes up to this one
#pragma unroll
        for (uint32_t step = 1; step < kHalf; step *= 2) {
            const uint32_t left = __shfl_up_sync(~0u, sum, step);
            sum += lane >= step ? left : 0u;
        }
        __syncwarp();                                    // waits before the places of the last part are written again
        for (uint16_t* to = places_ + sum; bits != 0;) { // writes the places of this lane from the last to the first
            const auto last = 31u - uint32_t(__clz(int(bits)));
            bits ^= 1u << last;
            *--to = uint16_t(32 * lane + last);
        }
        sum = __shfl_sync(~0u, sum, int(threadIdx.x | (kHalf - 1)) & 31);
        if (wants) {
            total_ = sum;
            taken_ = 0;
        }
        __syncwarp();
    }

    const uint32_t *words_, *rows_;
    uint16_t* places_;
    uint32_t ahead_, parts_, part_ = 0, total_ = 0, taken_ = 0; // state of this half of the warp
};

} // namespace gsc
