// SPDX-License-Identifier: Apache-2.0
// Selects anchors on the device: chunks and groups by their bounds, then single anchors by the trainers' test, for both
// eyes in one pass.
#pragma once

#include "kernels/frame/device_model.h"
#include "kernels/frame/frame_now.h"

struct CUstream_st;

namespace gsc {

struct SelectCudaArgs : FrameNow {
    using Now = FrameNow;

    DeviceModel model;
    uint32_t eye_count;
    RasterConstants rules;
    uint32_t* visible_groups;      // group_count elements: group | eyes << kAnchorBits
    const uint32_t* listed_groups; // groups whose anchors are tested: visible_groups, or some of those
    const uint32_t* group_count;   // number of elements in listed_groups
    uint32_t* visible;             // capacity elements: anchor | eyes << kAnchorBits
    float* fraction;               // 2 x capacity opacity factors, one for each eye; null unless levelsFade()
    uint32_t capacity;
    // kDepthBuckets counts, zero before: visible anchors of all eyes by view z, taken for one anchor of each warp
    uint32_t* histogram;
    FrameCounters* counters;
};

// Lists the groups that eyes may see. Asynchronous. `processors`: number of multiprocessors of the device, by which the
// number of blocks is chosen; likewise in every stage.
void selectGroupsCuda(const SelectCudaArgs& args, uint32_t processors, CUstream_st* stream);
// Lists the visible anchors of the listed groups. Asynchronous.
void selectAnchorsCuda(const SelectCudaArgs& args, uint32_t processors, CUstream_st* stream);

// Arguments for listing the visible anchors that one pass of a frame decodes: those that may have Gaussians at the
// depths of the pass.
struct PassListArgs : FrameNow {
    using Now = FrameNow;

    DeviceModel model;
    uint32_t eye_count;
    BinGrid grid;
    DepthPass pass;
    const uint32_t* visible; // capacity elements: anchor | eyes << kAnchorBits
    const float* fraction;   // 2 x capacity elements, or null
    uint32_t capacity;
    // capacity elements: entries of `visible`, with the eyes that may see something in this pass
    uint32_t* listed;
    float* listed_fraction;  // 2 x capacity elements; null if `fraction` is null
    FrameCounters* counters; // PassCounters::anchors_listed gets the number of anchors
};

// Lists the anchors of a pass before it is decoded, in a frame of several passes. To decode every visible anchor in
// every pass would give an equal picture, because decoding finds the pass of each Gaussian. Asynchronous.
void listPassCuda(const PassListArgs& args, uint32_t processors, CUstream_st* stream);

} // namespace gsc
