// SPDX-License-Identifier: Apache-2.0
// Which of a frame's visible anchors one of its passes decodes: those that may have Gaussians at its depths.
#pragma once

#include "kernels/frame/device_model.h"
#include "kernels/frame/frame_now.h"

struct CUstream_st;

namespace gsc {

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

// Of a frame of several passes, before each of them is decoded. Decoding every visible anchor in every pass would be right
// too; it asks each Gaussian. Asynchronous.
void listPassCuda(const PassListArgs& args, uint32_t processors, CUstream_st* stream);

} // namespace gsc
