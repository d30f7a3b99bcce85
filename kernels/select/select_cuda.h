// SPDX-License-Identifier: Apache-2.0
// Selection on the device: chunks and groups by bounds, then anchors by upstream's own test, both eyes in one pass.
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
    uint32_t* visible_groups;      // groups of the model: group | eyes << kAnchorBits
    const uint32_t* listed_groups; // groups whose anchors are tested: visible_groups, or some of them
    const uint32_t* group_count;   // number of listed_groups
    uint32_t* visible;             // capacity: anchor | eyes << kAnchorBits
    float* fraction;               // capacity x 2 or null: opacity factor per eye, if levelsFade()
    uint32_t capacity;
    uint32_t* histogram; // kDepthBuckets, zero before: view z of the visible anchors of all eyes, one sample per warp
    FrameCounters* counters;
};

// Asynchronous. `processors`: multiprocessors of the device, which size the grids; so in every stage.
void selectGroupsCuda(const SelectCudaArgs& args, uint32_t processors, CUstream_st* stream);
// lists anchors of the visible groups
void selectAnchorsCuda(const SelectCudaArgs& args, uint32_t processors, CUstream_st* stream);

// Arguments of listing the visible anchors that one pass of a frame decodes: those that may have Gaussians at its
// depths.
struct PassListArgs : FrameNow {
    using Now = FrameNow;

    DeviceModel model;
    uint32_t eye_count;
    BinGrid grid;
    DepthPass pass;
    const uint32_t* visible; // capacity: as select lists them
    const float* fraction;   // capacity x 2, or null
    uint32_t capacity;
    uint32_t* listed;        // capacity: entries of `visible` with the eyes that may see something in this pass
    float* listed_fraction;  // capacity x 2, null where `fraction` is
    FrameCounters* counters; // counted in PassCounters::anchors_listed
};

// Lists a pass's anchors before it is decoded, in a frame of several passes. Decoding every visible anchor in every
// pass would be right, too, because decoding asks each Gaussian for its pass. Asynchronous.
void listPassCuda(const PassListArgs& args, uint32_t processors, CUstream_st* stream);

} // namespace gsc
