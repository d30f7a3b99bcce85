// SPDX-License-Identifier: Apache-2.0
// Segments of long lists, of kSegmentUnits units each, behind the first units. A sub-tile that still takes light there may have
// most of a million keys to go through. A warp blends the segments of its pair of sub-tiles in turn; once other warps have
// nothing left to do, it puts those that it has not begun into a queue, and the others blend them apart.
//
// Pictures do not depend on which warp takes what when. Each segment but the first is blended as if all light reached it, and
// what it leaves is multiplied. The bound at which light ends is divided by the light that reaches the segment. Where only
// the light that reaches the first of those apart is known, that bound is too low: pixels whose light turns out to end in a
// segment have it blended again.
#pragma once

#include "kernels/blend/cuda/bins.cuh"

namespace gsc {

// The segments of a list for a sub-tile: this lane's pixels of segment 0.
template <typename T>
struct SegmentsOfTile {
    SegmentPixel* first;

    __device__ __forceinline__ SegmentsOfTile(const BlendCudaArgs& args, uint32_t first_unit, uint32_t sub_tile)
        : first(args.segments + (size_t(first_unit / kSegmentUnits) * (T::kBinRows * T::kBinColumns) + sub_tile) * 32 +
                threadIdx.x % kHalf)
    {
    }

    // Pixel `i` of this lane, as other multiprocessors left it.
    __device__ __forceinline__ SegmentPixel load(uint32_t segment, uint32_t i) const
    {
        const float4 four = __ldcg(reinterpret_cast<const float4*>(at(segment, i)));
        return {{four.x, four.y, four.z}, four.w};
    }

    __device__ __forceinline__ void store(uint32_t segment, uint32_t i, const float* color, float transmittance) const
    {
        *reinterpret_cast<float4*>(at(segment, i)) = {color[0], color[1], color[2], transmittance};
    }

    __device__ __forceinline__ void storeColor(uint32_t segment, uint32_t i, const float* color) const
    {
        for (int c = 0; c < 3; ++c)
            at(segment, i)->color[c] = color[c];
    }

    __device__ __forceinline__ float transmittance(uint32_t segment, uint32_t i) const
    {
        return __ldcg(&at(segment, i)->transmittance);
    }

private:
    __device__ __forceinline__ SegmentPixel* at(uint32_t segment, uint32_t i) const
    {
        return first + size_t(segment) * (T::kBinRows * T::kBinColumns * 32) + i * kHalf;
    }
};

// The bound of a segment's light that `light` reaches, which is not below the bound.
template <typename Rules>
__device__ __forceinline__ float leastOf(const BlendCudaArgs& args, float light)
{
    return __fdividef(args.lifted_stop, __fmul_rn(light, 1.0f / Rules::kWhole));
}

// The light behind a segment that leaves `left` of the whole; below zero if it ends there.
template <typename Rules>
__device__ __forceinline__ float behindSegment(const BlendCudaArgs& args, float light, float left)
{
    if (!Rules::takesLight(light, args.lifted_stop))
        return light;
    return left >= leastOf<Rules>(args, light) ? __fmul_rn(light, __fmul_rn(left, 1.0f / Rules::kWhole)) : -1.0f;
}

// Puts a segment behind `before`.
template <typename Rules>
__device__ __forceinline__ void join(const BlendCudaArgs& args, SegmentPixel& before, const float* color, float left)
{
    if (Rules::takesLight(before.transmittance, args.lifted_stop))
        for (int c = 0; c < 3; ++c)
            before.color[c] = fmaf(__fmul_rn(before.transmittance, 1.0f / Rules::kWhole), color[c], before.color[c]);
    before.transmittance = behindSegment<Rules>(args, before.transmittance, left);
}

// The light that reaches segment `segment` at pixel `i`, if it ends there; else -1. first: of those apart.
template <typename Rules, typename T>
__device__ __forceinline__ float lightThatEnds(const BlendCudaArgs& args, const SegmentsOfTile<T>& segments,
                                               uint32_t first, uint32_t segment, uint32_t i)
{
    float light = segments.transmittance(0, i);
#pragma unroll 4
    for (uint32_t s = first; s < segment; ++s)
        light = behindSegment<Rules>(args, light, segments.transmittance(s, i));
    return light >= 0.0f && behindSegment<Rules>(args, light, segments.transmittance(segment, i)) < 0.0f ? light
                                                                                                         : -1.0f;
}

// Calls f(segment) for those from `first` to before `end` in which light of a pixel ends. The whole warp together. wanted: of
// this half.
template <typename Rules, typename T, typename F>
__device__ __forceinline__ void forEnds(const BlendCudaArgs& args, const SegmentsOfTile<T>& segments, uint32_t first,
                                        uint32_t end, bool wanted, F&& f)
{
    float light[2] = {-1.0f, -1.0f};
    if (wanted)
        for (uint32_t i = 0; i < 2; ++i)
            light[i] = segments.transmittance(0, i);
    for (uint32_t s = first; s < end; ++s) {
        bool ends = false;
        if (wanted)
            for (uint32_t i = 0; i < 2; ++i) {
                const float behind = behindSegment<Rules>(args, light[i], segments.transmittance(s, i));
                ends |= light[i] >= 0.0f && behind < 0.0f;
                light[i] = behind;
            }
        if (__any_sync(~0u, ends))
            f(s);
    }
}

// A pixel behind all segments, those apart from `first` to before `end`.
template <typename Rules, typename T>
__device__ __forceinline__ SegmentPixel joined(const BlendCudaArgs& args, const SegmentsOfTile<T>& segments,
                                               uint32_t first, uint32_t end, uint32_t i)
{
    SegmentPixel sum = segments.load(0, i);
#pragma unroll 4
    for (uint32_t s = first; s < end; ++s) {
        const SegmentPixel pixel = segments.load(s, i);
        join<Rules>(args, sum, pixel.color, pixel.transmittance);
    }
    return sum;
}

// A queue of segments. An item is a segment's first unit times the pairs of a bin, plus the pair of sub-tiles, and kAgain if it
// is for the pixels whose light ends there. Each warp that asks gets a place of its own and polls only that: a thousand warps
// that poll one word slow each other down. At the end every place still waited for gets kEnd.
struct SegmentQueue {
    static constexpr uint32_t kAgain = 1u << 31, kNone = ~0u; // kNone: no item will come any more

    PassCounters& pass;
    uint32_t* items;
    uint32_t warps; // warps that may wait at the queue

    // Puts item(i) for i < count there. By one lane.
    template <typename F>
    __device__ __forceinline__ void push(uint32_t count, F&& item) const
    {
        __threadfence();
        const uint32_t at = atomicAdd(&pass.segments_pushed, count);
        for (uint32_t i = 0; i < count; ++i)
            atomicExch(&items[at + i], item(i) + 1);
    }

    __device__ __forceinline__ bool someoneWaits() const
    {
        return loadAcquire(&pass.segments_taken) > loadAcquire(&pass.segments_pushed);
    }

    // The next, or kNone; waits. By one lane, and not again after kNone.
    __device__ __forceinline__ uint32_t take() const
    {
        uint32_t* const at = items + atomicAdd(&pass.segments_taken, 1u);
        while (true) {
            const uint32_t item = loadAcquire(at);
            if (item != 0)
                return item - 1 == kEnd ? kNone : item - 1;
            __nanosleep(500);
        }
    }

    // After an item and all that it put there; by the whole warp. first: items that come from elsewhere.
    __device__ __forceinline__ void finish(uint32_t first) const
    {
        const uint32_t lane = threadIdx.x & 31u;
        uint32_t end = kNone;
        __syncwarp();
        if (lane == 0) {
            __threadfence();
            const uint32_t finished = atomicAdd(&pass.segments_finished, 1u) + 1;
            __threadfence(); // the other count must not be read before
            const uint32_t pushed = loadAcquire(&pass.segments_pushed);
            end = finished == first + pushed ? pushed : kNone;
        }
        end = __shfl_sync(~0u, end, 0);
        for (uint32_t i = lane; end != kNone && i < warps; i += 32)
            atomicExch(&items[end + i], kEnd + 1);
    }

private:
    static constexpr uint32_t kEnd = kNone - 1; // there are no more items
};

} // namespace gsc
