// SPDX-License-Identifier: Apache-2.0
// Segments of long lists, of kSegmentUnits units each, behind the first units. A sub-tile that still takes light there
// may have to go through most of a million keys. A warp blends the segments of its pair of sub-tiles in turn; once
// other warps have nothing left to do, it puts those that it has not begun into a queue, and the others blend them
// apart.
//
// Pictures do not depend on which warp takes what when. Each segment but the first is blended as if all light reached
// it, and what it leaves is multiplied. The bound at which light ends is divided by the light that reaches the segment.
// While only the light that reaches the first segment blended apart is known, that bound is too low: if the light of a
// pixel turns out to end in a segment, the segment is blended again for that pixel.
#pragma once

#include "kernels/blend/cuda/bins.cuh"

namespace gsc {

// Pixels of a sub-tile in each segment of its list. first: this lane's pixels of segment 0.
template <typename T>
struct SegmentsOfTile {
    SegmentPixel* first;

    __device__ __forceinline__ SegmentsOfTile(const BlendCudaArgs& args, uint32_t first_unit, uint32_t sub_tile)
        : first(args.segments + (size_t(first_unit / kSegmentUnits) * (T::kBinRows * T::kBinColumns) + sub_tile) * 32 +
                threadIdx.x % kHalf)
    {
    }

    // Reads pixel `i` of this lane as other multiprocessors stored it.
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

// Bound at which light ends in a segment that is blended as if all light reached it, while really `light` does.
// Precondition: `light` is not below the bound of the picture.
template <typename Rules>
__device__ __forceinline__ float leastOf(const BlendCudaArgs& args, float light)
{
    return __fdividef(args.lifted_stop, __fmul_rn(light, 1.0f / Rules::kWhole));
}

// Light behind a segment that lets the share `left` of its light through; below zero if light ends in the segment.
template <typename Rules>
__device__ __forceinline__ float behindSegment(const BlendCudaArgs& args, float light, float left)
{
    if (!Rules::takesLight(light, args.lifted_stop))
        return light;
    return left >= leastOf<Rules>(args, light) ? __fmul_rn(light, __fmul_rn(left, 1.0f / Rules::kWhole)) : -1.0f;
}

// Adds a segment (colour, share of light let through) behind the pixel `before`.
template <typename Rules>
__device__ __forceinline__ void join(const BlendCudaArgs& args, SegmentPixel& before, const float* color, float left)
{
    if (Rules::takesLight(before.transmittance, args.lifted_stop))
        for (int c = 0; c < 3; ++c)
            before.color[c] = fmaf(__fmul_rn(before.transmittance, 1.0f / Rules::kWhole), color[c], before.color[c]);
    before.transmittance = behindSegment<Rules>(args, before.transmittance, left);
}

// Light that reaches `segment` at pixel `i` if it ends there, else -1. first: first segment that was blended apart.
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

// Calls f(segment) for the segments [first, end) in which the light of some pixel ends. All lanes of the warp call it
// together. wanted: whether this half's sub-tile is blended.
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

// Pixel `i` of this lane with all segments joined; those in [first, end) were blended apart.
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

// Queue of segments, from which warps take work. An item is a segment's first unit times the pairs of a bin, plus the
// pair of sub-tiles; with kAgain the segment is blended again for pixels whose light ends there. Each warp that asks
// gets a place of its own and polls only that: a thousand warps that poll one word slow each other down. At the end
// each place that is still waited for gets kEnd.
struct SegmentQueue {
    static constexpr uint32_t kAgain = 1u << 31, kNone = ~0u; // kNone: no item is left and none will come

    PassCounters& pass;
    uint32_t* items;
    uint32_t warps; // number of warps that may wait at the queue

    // Puts item(i) for i < count into the queue. Called by one lane.
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

    // Takes the next item, and waits until there is one; returns kNone if there will be none. Called by one lane, and
    // not again after kNone.
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

    // To be called after an item, and all items that it put into the queue; by the whole warp. first: number of items
    // that come from outside the queue.
    __device__ __forceinline__ void finish(uint32_t first) const
    {
        const uint32_t lane = threadIdx.x & 31u;
        uint32_t end = kNone;
        __syncwarp();
        if (lane == 0) {
            __threadfence();
            const uint32_t finished = atomicAdd(&pass.segments_finished, 1u) + 1;
            __threadfence(); // so that the other count is not read before
            const uint32_t pushed = loadAcquire(&pass.segments_pushed);
            end = finished == first + pushed ? pushed : kNone;
        }
        end = __shfl_sync(~0u, end, 0);
        for (uint32_t i = lane; end != kNone && i < warps; i += 32)
            atomicExch(&items[end + i], kEnd + 1);
    }

private:
    static constexpr uint32_t kEnd = kNone - 1; // value of a place: there are no more items
};

} // namespace gsc
