// SPDX-License-Identifier: Apache-2.0
// A drawn picture, and its depths, into a target on the device.
#pragma once

#include <gsc/frame_target.h>
#include <gsc/frame_types.h>

struct CUstream_st;

namespace gsc {

struct PresentView {
    const float* image; // height x width x 3
    const float* depth; // height x width, where the target wants it
    FrameTarget target; // Device, with pitches, or Surface
    uint32_t width, height;
    ColumnRange columns; // columns that were drawn
    LensShape lens;
};

struct PresentCudaArgs {
    PresentView views[kMaxEyes];
    uint32_t count; // 1..
};

void presentCuda(const PresentCudaArgs& args, CUstream_st* stream); // asynchronous

} // namespace gsc
