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
    uint32_t* visible_groups; // groups of the model: group | eyes << kAnchorBits
    uint32_t* visible;        // capacity: anchor | eyes << kAnchorBits
    float* fraction;          // capacity x 2 or null: opacity factor per eye, if levelsFade()
    uint32_t capacity;
    uint32_t* histogram; // kDepthBuckets, zero before: view z of the visible anchors of all eyes, one sample per warp
    FrameCounters* counters;
};

// Asynchronous. `processors`: multiprocessors of the device, which size the grids; so in every stage.
void selectGroupsCuda(const SelectCudaArgs& args, uint32_t processors, CUstream_st* stream);
void selectAnchorsCuda(const SelectCudaArgs& args, uint32_t processors, CUstream_st* stream); // of the visible groups

} // namespace gsc
