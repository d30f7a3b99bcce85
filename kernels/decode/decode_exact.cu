// SPDX-License-Identifier: Apache-2.0
#include "kernels/decode/decode_exact_cuda.h"

#include "kernels/common/depth_cells.cuh"
#include "kernels/common/launch.cuh"
#include "kernels/project/project_body.h"

namespace gsc {

namespace {

constexpr uint32_t kThreads = 128;
constexpr uint32_t kBlocksPerProcessor = 8; // more would only add scratch: registers allow no more
constexpr uint32_t kLocalValues = 320;      // F = 32, K = 10, A = 32 need 275

__device__ uint32_t chunkOf(const ModelView& view, uint32_t anchor)
{
    uint32_t low = 0, high = uint32_t(view.params->chunk_count);
    while (high - low > 1) {
        const uint32_t mid = (low + high) / 2;
        if (view.chunks[mid].anchor_first <= anchor)
            low = mid;
        else
            high = mid;
    }
    return low;
}

// Bins of the pixels that upstream's tiles cover and alpha >= 1/255 can reach; kNoBins if there are none.
__device__ uint32_t binBox(const EyeParams& eye, uint32_t bin_height, const Footprint<float>& f, float opacity)
{
    float x0 = float(f.tiles.x0 * int32_t(kTileSize)), x1 = float(f.tiles.x1 * int32_t(kTileSize) - 1);
    float y0 = float(f.tiles.y0 * int32_t(kTileSize)), y1 = float(f.tiles.y1 * int32_t(kTileSize) - 1);
    if (f.cov.a * f.cov.c - f.cov.b * f.cov.b > 0.0f && f.cov.a > 0.0f && f.cov.c > 0.0f) {
        const float reach = 2.0f * logf(255.0f * opacity) * 1.0001f + 1e-3f;
        const float ex = sqrtf(reach * f.cov.a) * 1.0001f + 0.01f, ey = sqrtf(reach * f.cov.c) * 1.0001f + 0.01f;
        x0 = fmaxf(x0, floorf(f.x - ex));
        x1 = fminf(x1, ceilf(f.x + ex));
        y0 = fmaxf(y0, floorf(f.y - ey));
        y1 = fminf(y1, ceilf(f.y + ey));
    }
    x1 = fminf(x1, float(eye.width) - 1.0f);
    y1 = fminf(y1, float(eye.height) - 1.0f);
    if (x0 > x1 || y0 > y1)
        return kNoBins;
    return uint32_t(x0) / kBinWidth | uint32_t(y0) / bin_height << 8 | uint32_t(x1) / kBinWidth << 16 |
           uint32_t(y1) / bin_height << 24;
}

__global__ void __launch_bounds__(kThreads) decodeExactKernel(const __grid_constant__ DecodeExactArgs args)
{
    float local_scratch[kLocalValues];
    const uint32_t thread = blockIdx.x * kThreads + threadIdx.x;
    float* scratch = args.scratch != nullptr ? args.scratch + size_t(thread) * args.scratch_values : local_scratch;
    const Networks nets = findNetworks(args.view);
    const uint32_t count = min(args.counters->anchors_listed, args.visible_capacity);
    for (uint32_t item = thread; item < count * args.eye_count; item += gridDim.x * kThreads) {
        const uint32_t index = item % count, e = item / count;
        const uint32_t entry = args.visible[index];
        if ((entry >> kAnchorBits >> e & 1u) == 0)
            continue;
        const uint32_t anchor = entry & ((1u << kAnchorBits) - 1u);
        const uint32_t chunk = chunkOf(args.view, anchor);
        const EyeParams& eye = args.eyes[e];
        const float fraction = args.fraction != nullptr ? args.fraction[2 * index + e] : 1.0f;
        const float* placement = args.model.placement + size_t(4) * anchor;
        const float* steps = args.model.shape + size_t(6) * anchor;
        const float z = viewPoint<float>(eye, {placement[0], placement[1], placement[2]}).z;
        if (!mayBeIn(args.pass, args.grid, eye, {placement[0], placement[1], placement[2]},
                     float(kOffsetSteps) * norm3df(steps[0], steps[1], steps[2])))
            continue;
        const auto emit = [&](const GaussianOf<float>& g) {
            const Footprint<float> f = projectGaussian<float>(eye, args.rules, g);
            // what has no depth is counted in its anchor's pass
            if (args.pass.count > 1 && passOf(args.pass, args.grid, isFinite(f.depth) ? f.depth : z) != args.pass.index)
                return;
            atomicAdd(&args.counters->gaussians[e], 1u);
            if (!f.finite) {
                atomicAdd(&args.counters->dropped[e], 1u);
                return;
            }
            if (!f.visible)
                return;
            const uint32_t box = binBox(eye, args.grid.height, f, g.opacity);
            if (box == kNoBins)
                return;
            const uint32_t slot = atomicAdd(&args.counters->pass.slots[e], 1u);
            if (slot >= args.slot_capacity) {
                atomicOr(&args.counters->overflow, kSlotOverflow);
                return;
            }
            atomicAdd(&args.counters->splats[e], 1u);
            const size_t at = size_t(e) * args.slot_capacity + slot;
            ExactSplat& s = args.splats[at];
            s.x = f.x;
            s.y = f.y;
            s.opacity = g.opacity;
            for (int i = 0; i < 3; ++i) {
                s.conic[i] = f.conic[i];
                s.color[i] = g.color[i];
            }
            s.order_low = uint32_t(g.order);
            s.order_high = uint32_t(g.order >> 32);
            s.tx0 = uint16_t(f.tiles.x0);
            s.ty0 = uint16_t(f.tiles.y0);
            s.tx1 = uint16_t(f.tiles.x1);
            s.ty1 = uint16_t(f.tiles.y1);
            const SplatPlace place{__float_as_uint(f.depth), box};
            args.places[at] = place;
            atomicAdd(&args.counters->pass.pairs[e], (unsigned long long)binCount(box));
            uint32_t* cells = args.cells + size_t(e) * args.grid.cells();
            const uint32_t slab = args.pass.slab_of[depthBucket(place.depth_bits)] & (args.grid.slabs() - 1);
            for (uint32_t y = box >> 8 & 255u; y <= box >> 24; ++y)
                for (uint32_t x = box & 255u; x <= (box >> 16 & 255u); ++x)
                    atomicAdd(cells + ((y * args.grid.columns + x) << args.grid.slab_bits) + slab, 1u);
        };
        if (decodeAnchor<float>(args.view, nets, args.merged ? args.look_from : eye.center, chunk,
                                anchor - args.view.chunks[chunk].anchor_first, fraction, args.appearance, scratch,
                                emit))
            atomicOr(&args.counters->any_positive[e], 1u);
    }
}

} // namespace

size_t exactScratchValues(uint32_t per_thread, uint32_t processors)
{
    return per_thread > kLocalValues ? size_t(per_thread) * kThreads * kBlocksPerProcessor * processors : 0;
}

void decodeExactCuda(const DecodeExactArgs& args, uint32_t processors, CUstream_st* stream)
{
    launchCuda(decodeExactKernel, processors * kBlocksPerProcessor, kThreads, 0, stream, args);
}

} // namespace gsc
