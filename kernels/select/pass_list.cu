// SPDX-License-Identifier: Apache-2.0
#include "kernels/select/select_cuda.h"

#include "kernels/cuda/anchor_shape.cuh"
#include "kernels/cuda/depth_cells.cuh"
#include "kernels/cuda/launch.cuh"

namespace gsc {

namespace {

constexpr uint32_t kThreads = 256;
constexpr uint32_t kBlocksPerProcessor = 4;
constexpr uint32_t kAtOnce = 4; // entries that a lane reads at once, so that their loads are under way together

__global__ void __launch_bounds__(kThreads, kBlocksPerProcessor)
    passListKernel(const __grid_constant__ PassListArgs args)
{
    const uint32_t lane = threadIdx.x & 31u, warps = gridDim.x * (kThreads / 32);
    const uint32_t count = min(args.counters->anchors_listed, args.capacity);
    for (uint32_t first = (blockIdx.x * (kThreads / 32) + (threadIdx.x >> 5)) * (32 * kAtOnce); first < count;
         first += warps * (32 * kAtOnce)) {
        uint32_t entries[kAtOnce], keeping[kAtOnce], total = 0;
        float4 places[kAtOnce];
        AnchorShape shapes[kAtOnce];
#pragma unroll
        for (uint32_t i = 0; i < kAtOnce; ++i) {
            const uint32_t at = first + 32 * i + lane;
            entries[i] = at < count ? args.visible[at] : 0u; // an entry of 0 means no anchor
        }
#pragma unroll
        for (uint32_t i = 0; i < kAtOnce; ++i) {
            const uint32_t anchor = entries[i] & ((1u << kAnchorBits) - 1u);
            places[i] = reinterpret_cast<const float4*>(args.model.placement)[anchor];
            shapes[i] = anchorShape(args.model, anchor);
        }
#pragma unroll
        for (uint32_t i = 0; i < kAtOnce; ++i) {
            const float reach = anchorReach(args.model, shapes[i]);
            for (uint32_t e = 0; e < args.eye_count; ++e)
                if (!mayBeIn(args.pass, args.grid, args.eyes[e], {places[i].x, places[i].y, places[i].z}, reach))
                    entries[i] &= ~(1u << kAnchorBits << e);
            keeping[i] = __ballot_sync(~0u, entries[i] >> kAnchorBits != 0);
            total += __popc(keeping[i]);
        }
        uint32_t base = 0;
        if (lane == 0 && total != 0)
            base = atomicAdd(&args.counters->pass.anchors_listed, total);
        base = __shfl_sync(~0u, base, 0);
#pragma unroll
        for (uint32_t i = 0; i < kAtOnce; ++i) {
            if (entries[i] >> kAnchorBits != 0) {
                const uint32_t at = base + __popc(keeping[i] & ((1u << lane) - 1u));
                args.listed[at] = entries[i];
                if (args.fraction != nullptr)
                    reinterpret_cast<float2*>(args.listed_fraction)[at] =
                        reinterpret_cast<const float2*>(args.fraction)[first + 32 * i + lane];
            }
            base += __popc(keeping[i]);
        }
    }
}

} // namespace

void listPassCuda(const PassListArgs& args, uint32_t processors, CUstream_st* stream)
{
    launchCuda(passListKernel, processors * kBlocksPerProcessor, kThreads, 0, stream, args);
}

} // namespace gsc
