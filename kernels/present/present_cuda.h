// SPDX-License-Identifier: Apache-2.0
// Copies a drawn picture and its depths to targets on the device.
#pragma once

#include <gsc/frame_target.h>
#include <gsc/frame_types.h>

struct CUstream_st;

namespace gsc {

struct PresentView {
    const float* image; // height x width x 3 values
    const float* depth; // height x width values, if the target wants depths
    FrameTarget target; // kind Device, with pitches, or Surface
    uint32_t width, height;
    ColumnRange columns; // columns of the picture that were drawn
    LensShape lens;
};

struct PresentCudaArgs {
    PresentView views[kMaxEyes];
    uint32_t count; // number of pictures, 1 or more
};

void presentCuda(const PresentCudaArgs& args, CUstream_st* stream); // copies and converts all pictures; asynchronous

} // namespace gsc
