// SPDX-License-Identifier: Apache-2.0
// The cut cache on the device. Unlike the CPU's it keeps whole groups only: those with an anchor that nothing is proven
// about are tested anew whenever the camera moves, because a warp that tests one anchor takes as long as for all of them.
#pragma once

#include "kernels/select/select_cuda.h"

#include <cuda_runtime.h>

namespace gsc {

template <typename Args>
constexpr bool kHasCut = requires(const Args& args)
{
    args.cut;
};

__device__ __forceinline__ bool cutHolds(const CutNow& now, uint32_t eye, const CutOutcome& outcome, uint32_t group)
{
    // no outcome has a slack that nothing is within
    return now.pose[eye] - outcome.pose < cutLife(group) &&
           now.motion[eye][outcome.pose % kCutPoses].within(outcome.slack, outcome.reach);
}

// Is what an eye sees of the group to be found anew? That costs as much again as to test it, so for an outcome that did
// not last it waits.
__device__ __forceinline__ bool cutIsDue(const CutNow& now, uint32_t eye, const CutOutcome& outcome)
{
    constexpr uint32_t kPatience = 8; // poses
    return !(outcome.slack == outcome.slack) || now.pose[eye] - outcome.pose >= kPatience;
}

__device__ inline LodClassifier groupLod(const SelectCudaArgs& args, const GroupRecord& group)
{
    return lodClassifier(args.model.params, args.model.levels[group.level_index].level,
                         args.model.lod_shift[group.level_index], args.lod_bias);
}

// Keeps that an eye sees nothing of a group, because groupMayShow() says so.
__device__ inline void keepHidden(const SelectCudaArgs& args, const CutArgs& cut, uint32_t eye, uint32_t index,
                                  const GroupRecord& group)
{
    const EyeClassifier& classifier = cut.now.eyes[eye];
    const float slack = boxSlack(classifier, cut.now.scales[eye], groupLod(args, group), group.anchor_min,
                                 group.anchor_max, group.anchor_sigma_max, group.extra_level_max);
    const float reach = farthest(group.anchor_min, group.anchor_max, classifier.bounds.center);
    cut.tables.outcomes[eye][index] = {slack, reach, cut.now.pose[eye], 0};
}

// What the warps of a block found of a group, per eye.
struct CutShared {
    uint32_t slack[kMaxEyes][kGroupSize / 32]; // the least, as bits, which order like it because it is not negative
    uint32_t visible[kMaxEyes][kGroupSize / 32];
};

// A warp's part of what an eye sees of a group; one anchor per lane. there: the lane has one. visible: votes of the warp.
__device__ inline void findWarp(const SelectCudaArgs& args, const CutNow& now, uint32_t eye, const GroupRecord& group,
                                bool there, const float4& placement, uint32_t visible, CutShared& shared)
{
    const EyeClassifier& classifier = now.eyes[eye];
    float slack = kEndlessSlack;
    if (there && classifier.usable) {
        const float* size = args.model.size + size_t(3) * (group.anchor_first + threadIdx.x);
        const float sum = size[0] + size[1] + size[2];
        const float sigma = sum == sum ? fmaxf(size[0], fmaxf(size[1], size[2])) : sum;
        slack = anchorSlack(classifier, now.scales[eye], groupLod(args, group), {placement.x, placement.y, placement.z},
                            sigma, placement.w);
    } else if (there) {
        slack = 0;
    }
    const uint32_t least = __reduce_min_sync(~0u, __float_as_uint(slack));
    if ((threadIdx.x & 31u) == 0) {
        shared.slack[eye][threadIdx.x / 32] = least;
        shared.visible[eye][threadIdx.x / 32] = visible;
    }
}

// Keeps what the warps found; by one thread, after all of them.
__device__ inline void keepFound(const CutArgs& cut, uint32_t eye, uint32_t index, const GroupRecord& group,
                                 const CutShared& shared)
{
    uint32_t least = __float_as_uint(kEndlessSlack), shows = 0;
    CutLanes lanes;
    for (uint32_t w = 0; w < kGroupSize / 32; ++w) {
        least = min(least, shared.slack[eye][w]);
        lanes.visible[w] = shared.visible[eye][w];
        shows |= lanes.visible[w];
    }
    const float reach = farthest(group.anchor_min, group.anchor_max, cut.now.eyes[eye].bounds.center);
    cut.tables.lanes[eye][index] = lanes;
    cut.tables.outcomes[eye][index] = {__uint_as_float(least), reach, cut.now.pose[eye], shows};
}

} // namespace gsc
