// SPDX-License-Identifier: Apache-2.0
// A drawn picture into a target on the device.
#pragma once

#include "kernels/frame/frame_target.h"

struct CUstream_st;

namespace gsc {

struct PresentCudaArgs {
    const float* image; // height x width x 3
    FrameTarget target; // Device, with a pitch, or Surface
    uint32_t width, height;
};

void presentCuda(const PresentCudaArgs& args, CUstream_st* stream); // asynchronous

} // namespace gsc
