// SPDX-License-Identifier: Apache-2.0
// Selection on the device: groups by bounds, then anchors by upstream's own test, both eyes in one pass. With the cut cache
// (cut_margin.h) what earlier frames found of a group is taken in place of its tests, as long as it surely holds.
#pragma once

#include "kernels/common/device_model.h"
#include "kernels/schedule/reuse_cuda.h"
#include "kernels/select/cut_poses.h"

struct CUstream_st;

namespace gsc {

struct SelectCudaArgs {
    DeviceModel model;
    EyeParams eyes[kMaxEyes]; // their centres are where levels are chosen from, and serve nothing else
    uint32_t eye_count;
    RasterConstants rules;
    float lod_bias, lod_fade;
    uint32_t group_count;
    uint32_t* visible_groups; // group_count: group | eyes << kAnchorBits; the known ones of WithCut from the end on
    uint32_t* visible;        // capacity: anchor | eyes << kAnchorBits
    float* fraction;          // capacity x 2 or null: opacity factor per eye, if levelsFade()
    uint32_t capacity;
    uint32_t* histogram; // kDepthBuckets, zero before: view z of the visible anchors of all eyes, one sample per warp
    FrameCounters* counters;
};

// For frames with reuse: strips go to tables.listed in place of the visible list, and `fraction` is per listed strip, eye
// and anchor of the strip.
struct StripSelectArgs : SelectCudaArgs {
    ReuseTables tables;
    uint32_t frame;    // ReuseNow
    bool counts_fresh; // ReusePolicy::Depth
};

// What the last test of a group found, per eye. All bits set: nothing.
struct alignas(16) CutOutcome {
    float slack; // the least of its anchors; not a number: there is no outcome
    float reach;
    uint32_t pose;  // number of the pose that it was found at
    uint32_t shows; // 0: nothing of it is visible
};

struct alignas(16) CutLanes {
    uint32_t visible[kGroupSize / 32];
};

struct CutTables { // device memory, an entry per group
    CutOutcome* outcomes[kMaxEyes];
    CutLanes* lanes[kMaxEyes]; // of outcomes that show something
};

// Where the eyes are, and how they got there (CutPoses).
struct CutNow {
    EyeClassifier eyes[kMaxEyes];
    CutScales scales[kMaxEyes];
    CutMotion motion[kMaxEyes][kCutPoses];
    uint32_t pose[kMaxEyes];
};

struct CutArgs {
    CutTables tables;
    CutNow now;
};

// Arguments with the cut cache. Only where levels do not fade. A group is known if the tables have all that is seen of it;
// such groups are listed from the end of visible_groups on. The others are tested, and bit e of tries << kTryShift in their
// entries says that what eye e sees is to be kept.
template <typename Args>
struct WithCut : Args {
    CutArgs cut;
};

constexpr uint32_t kTryShift = kAnchorBits - kMaxEyes;

static_assert(sizeof(WithCut<StripSelectArgs>) <= 4096); // what a kernel can be given everywhere

// Asynchronous. `processors`: multiprocessors of the device, which size the grids; so in every stage.
void selectGroupsCuda(const SelectCudaArgs& args, uint32_t processors, CUstream_st* stream);
void selectAnchorsCuda(const SelectCudaArgs& args, uint32_t processors, CUstream_st* stream); // of the visible groups
void selectStripsCuda(const StripSelectArgs& args, uint32_t processors, CUstream_st* stream); // the same
void selectGroupsCuda(const WithCut<SelectCudaArgs>& args, uint32_t processors, CUstream_st* stream);
void selectAnchorsCuda(const WithCut<SelectCudaArgs>& args, uint32_t processors, CUstream_st* stream);
void selectStripsCuda(const WithCut<StripSelectArgs>& args, uint32_t processors, CUstream_st* stream);
void selectKnownCuda(const WithCut<SelectCudaArgs>& args, uint32_t processors,
                     CUstream_st* stream); // lists the known ones
void selectKnownCuda(const WithCut<StripSelectArgs>& args, uint32_t processors, CUstream_st* stream);

} // namespace gsc
