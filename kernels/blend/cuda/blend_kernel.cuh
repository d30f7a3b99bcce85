// SPDX-License-Identifier: Apache-2.0
// Blending on a device: read this first. The kernels here take the sorted lists of bins (kernels/bin, kernels/sort) and
// write the pictures of the eyes, from near to far. Each tier compiles them in a file of its own (blend_fast.cu,
// blend_exact.cu), because nvcc may fuse multiply-adds in one and not in the other. Pictures of either tier, costs and depths
// come of the same kernels with other Rules (rules.cuh): the alpha of a splat at a pixel, the light behind it, where light ends.
//
// The unit of work is half a warp that blends a sub-tile of 32 pixels, two in a row for each lane, so that a splat is read
// and computed once for both. A sub-tile takes only splats whose ellipse touches it (sub_tiles.cuh), four at a time without a
// branch, until none of its pixels takes light. Bins wait in a queue, fullest first; bins.cuh says where one lies in an
// eye's image, and how its pixels begin and end.
//
// Short lists (short_lists.cuh, blendKernel): four warps share a bin, a quarter each. They turn 128 splats at a time into
// what the rules read, in shared memory, with a mask of the sub-tiles that each touches, while the next 128 are on their
// way from memory. Then each warp lists the splats of each of its sub-tiles, and blends list by list.
//
// Long lists, of 1024 splats or more, would keep four warps busy for too long. So the whole device first finds what each
// splat touches (touch.cuh, touchKernel): a bit for every splat and sub-tile, and for every splat and row of pixels. The
// sub-tiles are narrower there, because far splats crowd in few rows. Decode left a code of 16 bits that tells it of a
// small splat; others are looked at. Then half a warp blends a sub-tile by itself, without a barrier, and fetches only what
// touches it in rows that still take light (long_lists.cuh, tileKernel). Most sub-tiles are finished early in their list:
// of the longest lists, of 32,768 splats or more, only so many are looked at and blended at first.
//
// Behind those, in `fast`, lists are cut into segments of 8192 splats, so that a frame does not wait for one warp
// (segments.cuh). Warps with nothing left to do take segments that others have not begun; each is blended as if all light
// reached it, and what it leaves is multiplied.
//
// The order of launches (launchRows()):
//   1. touchKernel: the first 16 units, of 2048 splats, of every long list.
//   2. tileKernel, First: the longest lists as far as that. If there are none, all long lists.
//   3. blendKernel: the short lists, beside the end of 2, which leaves multiprocessors idle.
//   4. touchKernel, behind: the other units of lists with a sub-tile that still takes light.
//   5. tileKernel, Behind: what is left of the longest lists, and the other long ones. Nothing, if 2 had all.
// Where depths are wanted, tileKernel (All) and blendKernel follow once more with DepthRules: instances of their own, so that
// those of pictures keep their registers.
//
// The headers, each of which needs only those before it: sub_tiles.cuh, rules.cuh, bins.cuh, short_lists.cuh; touch.cuh,
// segments.cuh, long_lists.cuh. kernels/README.md says what a picture depends on and what memory long lists take.
#pragma once

#include "kernels/blend/cuda/long_lists.cuh"
#include "kernels/blend/cuda/short_lists.cuh"

namespace gsc {

// Blends the bins whose lists are short, beside the end of LongPart::First (for depths: All), which leaves
// multiprocessors idle. kRows: rows of sub-tiles of each of the four warps that share a bin.
template <typename Rules, uint32_t kRows>
__global__ void __launch_bounds__(kBlendThreads, kBlendBlocks) blendKernel(const __grid_constant__ BlendCudaArgs args)
{
    if (willRepeat(*args.counters)) {
        waitForEarlier();
        return;
    }
    GSC_DYNAMIC_SHARED(memory);
    using Shared = BlendShared<Rules, kRows>;
    static_assert(sizeof(Shared) <= 99 * 1024); // a block can have no more on compute capability 8.6, 8.9 and 12.0
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
    waitForEarlier(); // so that the frame is not done before the long lists are
}

// Returns true if the kernel may start beside the one before it, for which it waits before it ends; code for older
// devices does not wait.
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
    // limits the number of blocks to those that the device holds at once, since they take bins from a queue
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

// Launches the kernels for the cost, whose picture has black behind the counts.
template <typename Rules>
void launchCost(BlendCudaArgs args, uint32_t processors, CUstream_st* stream)
{
    args.empty_is_black = false;
    for (float& value : args.background)
        value = 0;
    launchBlend<Rules>(args, processors, stream);
}

} // namespace gsc
