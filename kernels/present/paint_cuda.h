// SPDX-License-Identifier: Apache-2.0
// False colours on the device: splats are painted between decoding and blending, counts of pixels after it. Neither stage
// knows of it.
#pragma once

#include "kernels/decode/decode_cuda.h"
#include "kernels/present/false_colour.h"

struct CUstream_st;

namespace gsc {

struct PaintCudaArgs {
    void* splats; // PackedSplat or ExactSplat, eye_count x slot_capacity
    bool exact;
    bool shared_bins;
    uint32_t eye_count;
    uint32_t slot_capacity;
    const SplatPlace* places;
    const FrameCounters* counters;
    uint32_t n_offsets;
    // per source index: kGroupSize x its group + its place there; or null: all are painted in one colour
    const uint32_t* origins;
    FalseColour colour; // colour of all where `origins` is null
    const GroupRecord* groups;
    const LevelRecord* levels;
};

struct CostCudaArgs {
    float* image[kMaxEyes];    // red: evaluations of the pixel
    uint32_t pixels[kMaxEyes]; // pixels of each eye
    uint32_t eye_count;
    const FrameCounters* counters;
};

// All asynchronous. FrameView::Level, or all in one colour.
void paintSplatsCuda(const PaintCudaArgs& args, uint32_t processors, CUstream_st* stream);
// FrameView::Cost, after the last pass.
void paintCostCuda(const CostCudaArgs& args, uint32_t processors, CUstream_st* stream);

} // namespace gsc
