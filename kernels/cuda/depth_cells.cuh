// SPDX-License-Identifier: Apache-2.0
// Finds the cells (bins cut in depth) that a splat falls into.
#pragma once

#include "kernels/cuda/warp_list.cuh"
#include "kernels/frame/device_model.h"
#include "kernels/math/projection.h"

#include <cuda_runtime.h>

namespace gsc {

// Bucket of a depth: 1024 per octave from 2^-4 to 2^28; smaller depths are in the first bucket, larger in the last.
__device__ __forceinline__ uint32_t depthBucket(uint32_t depth_bits)
{
    const int bucket = int(depth_bits >> 13) - ((127 - 4) << 10);
    return uint32_t(min(max(bucket, 0), int(kDepthBuckets) - 1));
}

// Number of bins in a SplatPlace::box. Precondition: `box` is not kNoBins.
__device__ __forceinline__ uint32_t binCount(uint32_t box)
{
    return ((box >> 16 & 255u) - (box & 255u) + 1) * ((box >> 24) - (box >> 8 & 255u) + 1);
}

// Pass that draws view depth z; the first one for depths behind the eye and for NaN.
__device__ __forceinline__ uint32_t passOf(const DepthPass& pass, const BinGrid& grid, float z)
{
    return pass.slab_of[depthBucket(__float_as_uint(fmaxf(z, 0.0f)))] >> grid.slab_bits;
}

// Returns true if an anchor at `p` can have Gaussians in this pass. reach: largest distance of its Gaussians; it is
// widened by more than rounding can change view z of a point there.
__device__ __forceinline__ bool mayBeIn(const DepthPass& pass, const BinGrid& grid, const EyeParams& eye,
                                        const Vec3<float>& p, float reach)
{
    const float z = viewPoint<float>(eye, p).z;
    const float size =
        fabsf(p.x) + fabsf(p.y) + fabsf(p.z) + fabsf(eye.center[0]) + fabsf(eye.center[1]) + fabsf(eye.center[2]);
    const float r = reach * 1.001f + size * 4e-6f;
    if (!(r < INFINITY))
        return true;
    return passOf(pass, grid, z - r) <= pass.index && passOf(pass, grid, z + r) >= pass.index;
}

// Calls take(cell) and then put(what take gave, depth_bits, slot) for every cell of one eye that the splats of a warp
// fall into. All lanes of the warp call it together; a lane without a splat passes a place of kNoBins. A splat of few
// bins is done by its lane, which calls take() for all before put() for the first, so that their atomics are under way
// together. The cells of larger splats are shared out to all lanes of the warp, one splat after the other, so that no
// lane delays the rest; for these take_other(cell) is called, for kOthers cells of a lane at once.
template <uint32_t kOthers, typename Take, typename TakeOther, typename Put>
__device__ __forceinline__ void forCellsOfWarp(const BinGrid& grid, const uint16_t* slab_of, const SplatPlace& place,
                                               uint32_t slot, Take take, TakeOther take_other, Put put)
{
    constexpr uint32_t kFew = 4;
    const uint32_t lane = threadIdx.x & 31u;
    const uint32_t x0 = place.box & 255u, y0 = place.box >> 8 & 255u, x1 = place.box >> 16 & 255u, y1 = place.box >> 24;
    const bool some = place.box != kNoBins;
    const uint32_t width = x1 - x0 + 1, count = some ? width * (y1 - y0 + 1) : 0u;
    const uint32_t slab = some ? slab_of[depthBucket(place.depth_bits)] & (grid.slabs() - 1) : 0u;
    const uint32_t few = count <= kFew ? count : 0u;
    decltype(take(0u)) taken[kFew] = {};
    uint32_t x = x0, y = y0;
#pragma unroll
    for (uint32_t i = 0; i < kFew; ++i) {
        if (i < few)
            taken[i] = take(((y * grid.columns + x) << grid.slab_bits) + slab);
        y += x == x1 ? 1u : 0u;
        x = x == x1 ? x0 : x + 1;
    }
#pragma unroll
    for (uint32_t i = 0; i < kFew; ++i)
        if (i < few)
            put(taken[i], place.depth_bits, slot);
    if (!__any_sync(~0u, count > kFew))
        return;
    const uint32_t many = count - few, end = sumUpTo(many); // sum of the lanes' counts up to this lane
    const uint32_t all = __shfl_sync(~0u, end, 31), begin = end - many;
    for (uint32_t first = 0; first < all; first += 32 * kOthers) {
        decltype(take(0u)) others[kOthers] = {};
        int owners[kOthers];
#pragma unroll
        for (uint32_t j = 0; j < kOthers; ++j) {
            const uint32_t i = first + 32 * j + lane;
            const int owner = ownerOf(i, end);
            owners[j] = owner;
            const uint32_t box = __shfl_sync(~0u, place.box, owner), cell = i - __shfl_sync(~0u, begin, owner);
            const uint32_t of = __shfl_sync(~0u, slab, owner), w = (box >> 16 & 255u) - (box & 255u) + 1;
            if (i < all) {
                const uint32_t row = (box >> 8 & 255u) + cell / w, column = (box & 255u) + cell % w;
                others[j] = take_other(((row * grid.columns + column) << grid.slab_bits) + of);
            }
        }
#pragma unroll
        for (uint32_t j = 0; j < kOthers; ++j) {
            const uint32_t depth_bits = __shfl_sync(~0u, place.depth_bits, owners[j]);
            const uint32_t its_slot = __shfl_sync(~0u, slot, owners[j]);
            if (first + 32 * j + lane < all)
                put(others[j], depth_bits, its_slot);
        }
    }
}

} // namespace gsc
