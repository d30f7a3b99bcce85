// SPDX-License-Identifier: Apache-2.0
// The kernel that blends, and its launch. Each tier has it in a file of its own, because they are compiled with different
// rules for fused multiply-adds.
#pragma once

#include "kernels/blend/cuda/long_lists.cuh"
#include "kernels/blend/cuda/short_lists.cuh"

namespace gsc {

// The bins whose lists are not long, beside LongPart::First (for depths, All), whose end leaves multiprocessors idle.
// kRows: rows of sub-tiles of a warp that shares its bin with three others.
template <typename Rules, uint32_t kRows>
__global__ void __launch_bounds__(kBlendThreads, kBlendBlocks) blendKernel(const __grid_constant__ BlendCudaArgs args)
{
    if (willRepeat(*args.counters)) {
        waitForEarlier();
        return;
    }
    GSC_DYNAMIC_SHARED(memory);
    using Shared = BlendShared<Rules, kRows>;
    static_assert(sizeof(Shared) <= 99 * 1024); // what a block can have on compute capability 8.6, 8.9 and 12.0
    Shared& shared = *reinterpret_cast<Shared*>(memory);
    const uint32_t warp = threadIdx.x >> 5, g = threadIdx.x / kGroup;
    const uint32_t readers = args.shared_bins ? kMaxEyes : 1u;
    const uint32_t all_bins = readers * args.counters->pass.bins, long_bins = readers * args.counters->pass.long_bins;
    uint32_t evaluations[kMaxEyes] = {};
    const auto tally = [&](uint32_t e, uint32_t seen) {
        evaluations[0] += e == 0 ? seen : 0u;
        evaluations[1] += e == 0 ? 0u : seen;
    };

    const Team group{1 + g, threadIdx.x % kGroup};
    constexpr uint32_t kBatch = (kGroup + 1) * sizeof(typename Rules::Lit);
    const Batches<typename Rules::Lit, typename Shared::Entry> own{
        reinterpret_cast<char*>(memory),
        {g * kBatch, (kGroups + g) * kBatch},
        {shared.touched[0] + g * kGroup, shared.touched[1] + g * kGroup},
        shared.lists[warp]};
    if (group.thread < 2)
        shared.batches[group.thread][g][kGroup] = Rules::nothing();
    while (true) {
        if (group.thread == 0)
            shared.next[g] = long_bins + atomicAdd(&args.counters->pass.next_bin[Rules::kDepth], 1u);
        group.sync();
        const uint32_t i = shared.next[g];
        group.sync();
        if (i >= all_bins)
            break;
        using T = typename Shared::Tile;
        const BinOfEye bin = binAt(args, i);
        Area area{};
        uint32_t seen = 0;
        if (areaOf<T>(args, bin, area))
            blendBin<Rules, T>(args, group, own, area, seen);
        tally(bin.eye, seen);
    }
    if constexpr (!Rules::kDepth)
        countEvaluations(args, evaluations);
    waitForEarlier(); // the frame is not done before its long lists are
}

// A kernel may start beside another if it waits for that one in the end, which code for older devices does not.
template <typename Kernel>
bool waitsInTheEnd(Kernel* kernel)
{
    cudaFuncAttributes attributes{};
    GSC_CUDA_CHECK(cudaFuncGetAttributes(&attributes, kernel));
    return attributes.binaryVersion >= 90;
}

template <typename Rules, uint32_t kRows>
void launchRows(const BlendCudaArgs& args, uint32_t processors, CUstream_st* stream)
{
    // blocks take bins from a queue, so more of them than the device holds at once would only wait for nothing
    const auto tiles = [&](LongPart part) {
        launchCuda(tileKernel<Rules, kRows>, processors * Rules::kLoneBlocks, kLoneThreads, 0, stream, args, part);
    };
    const auto others = [&] {
        launchCudaAs(waitsInTheEnd(blendKernel<Rules, kRows>), blendKernel<Rules, kRows>, processors * kBlendBlocks,
                     kBlendThreads, sizeof(BlendShared<Rules, kRows>), stream, args);
    };
    if constexpr (Rules::kDepth) {
        tiles(LongPart::All);
        others();
    } else {
        const auto touch = [&](bool behind) {
            launchCuda(touchKernel<Rules, kRows>, processors * kTouchBlocks<Rules>, kTouchThreads, 0, stream, args,
                       behind);
        };
        touch(false);
        tiles(LongPart::First);
        others();
        touch(true);
        tiles(LongPart::Behind);
    }
}

template <typename Rules>
void launchBlend(const BlendCudaArgs& args, uint32_t processors, CUstream_st* stream)
{
    if (args.grid.height == 16)
        launchRows<Rules, 2>(args, processors, stream);
    else
        launchRows<Rules, 4>(args, processors, stream);
}

// Nothing is behind the counts.
template <typename Rules>
void launchCost(BlendCudaArgs args, uint32_t processors, CUstream_st* stream)
{
    args.empty_is_black = false;
    for (float& value : args.background)
        value = 0;
    launchBlend<Rules>(args, processors, stream);
}

} // namespace gsc
