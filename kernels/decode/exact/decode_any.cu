// SPDX-License-Identifier: Apache-2.0
// Decodes models whose networks the tiles cannot take, with the scalar arithmetic of the reference: one thread per
// anchor and eye.
#include "kernels/cuda/launch.cuh"
#include "kernels/decode/exact/exact_splat.cuh"

namespace gsc {

namespace {

constexpr uint32_t kThreads = 128;
constexpr uint32_t kBlocksPerProcessor = 8; // registers allow no more; a larger number would only add scratch
constexpr uint32_t kLocalValues = 320;      // scratch values in a thread's own memory; F = 32, K = 10, A = 32 need 275

__global__ void __launch_bounds__(kThreads) decodeAnyKernel(const __grid_constant__ DecodeExactArgs args)
{
    float local_scratch[kLocalValues];
    const uint32_t thread = blockIdx.x * kThreads + threadIdx.x;
    float* scratch = args.scratch != nullptr ? args.scratch + size_t(thread) * args.scratch_values : local_scratch;
    const uint32_t count = min(*args.visible_count, args.visible_capacity);
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
        const float z = viewPoint<float>(eye, {placement[0], placement[1], placement[2]}).z;
        const auto emit = [&](const GaussianOf<float>& g) {
            const Footprint<float> f = projectGaussian<float>(eye, args.rules, g);
            // a Gaussian whose depth is not finite is counted in the pass of its anchor
            if (args.pass.count > 1 && passOf(args.pass, args.grid, isFinite(f.depth) ? f.depth : z) != args.pass.index)
                return;
            atomicAdd(&args.counters->gaussians[e], 1u);
            if (!f.finite) {
                atomicAdd(&args.counters->dropped[e], 1u);
                return;
            }
            if (!f.visible)
                return;
            const uint32_t box = binBox(args, e, f, g.opacity);
            if (box == kNoBins)
                return;
            const uint32_t slot = atomicAdd(&args.counters->pass.slots[e], 1u);
            if (slot >= args.slot_capacity) {
                atomicOr(&args.counters->overflow, kSlotOverflow);
                return;
            }
            atomicAdd(&args.counters->splats[e], 1u);
            const size_t at = size_t(e) * args.slot_capacity + slot;
            args.splats[at] = exactSplat(f, g);
            const SplatPlace place{__float_as_uint(f.depth), box};
            args.places[at] = place;
            atomicAdd(&args.counters->pass.pairs[e], (unsigned long long)binCount(box));
            uint32_t* cells = args.cells + size_t(e) * args.grid.cells();
            const uint32_t slab = args.pass.slab_of[depthBucket(place.depth_bits)] & (args.grid.slabs() - 1);
            for (uint32_t y = box >> 8 & 255u; y <= box >> 24; ++y)
                for (uint32_t x = box & 255u; x <= (box >> 16 & 255u); ++x)
                    atomicAdd(cells + ((y * args.grid.columns + x) << args.grid.slab_bits) + slab, 1u);
        };
        if (decodeAnchor<float>(args.view, args.merged ? args.look_from : eye.center, chunk,
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

void decodeExactAnyCuda(const DecodeExactArgs& args, uint32_t processors, CUstream_st* stream)
{
    launchCuda(decodeAnyKernel, processors * kBlocksPerProcessor, kThreads, 0, stream, args);
}

} // namespace gsc
