// SPDX-License-Identifier: Apache-2.0
// False colours on the device: splats are painted between decoding and blending, counts of pixels after blending. Those
// stages need not know of it.
#pragma once

#include "kernels/decode/decode_cuda.h"
#include "kernels/present/false_colour.h"

struct CUstream_st;

namespace gsc {

struct PaintCudaArgs {
    void* splats; // PackedSplat or ExactSplat, eye_count x slot_capacity elements
    bool exact;
    bool shared_bins;
    uint32_t eye_count;
    uint32_t slot_capacity;
    const SplatPlace* places;
    const FrameCounters* counters;
    uint32_t n_offsets;
    // for each source index: kGroupSize x number of the anchor's group + number in the group; null: all splats are
    // painted in one colour
    const uint32_t* origins;
    FalseColour colour; // colour of all splats if `origins` is null
    const GroupRecord* groups;
    const LevelRecord* levels;
};

struct CostCudaArgs {
    float* image[kMaxEyes];    // pictures whose red channel holds the number of evaluations of the pixel
    uint32_t pixels[kMaxEyes]; // number of pixels of each eye
    uint32_t eye_count;
    const FrameCounters* counters;
};

// Paints splats for FrameView::Level, or all in one colour. Asynchronous.
void paintSplatsCuda(const PaintCudaArgs& args, uint32_t processors, CUstream_st* stream);
// Paints pixels for FrameView::Cost, after the last pass. Asynchronous.
void paintCostCuda(const CostCudaArgs& args, uint32_t processors, CUstream_st* stream);

} // namespace gsc
