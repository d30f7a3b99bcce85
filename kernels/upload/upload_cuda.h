// SPDX-License-Identifier: Apache-2.0
// A chunk payload, as it lies in the file, into the flat arrays the CUDA stages read.
#pragma once

#include "kernels/frame/device_model.h"

struct CUstream_st;

namespace gsc {

// Device arrays of the whole model, for DeviceModel to point to.
struct AnchorArrays {
    float *placement, *size, *shape;
    float* rotation; // null = none
    uint32_t* source;
    uint16_t* feature;           // null = none
    uint64_t* offset;            // null = none
    CompactShape* compact_shape; // DeviceModel
    uint32_t *compact_feature, *compact_offset;
};

struct UploadArgs {
    ChunkRecord chunk;
    LevelRecord level;
    ChunkArrayLayout layout;
    const unsigned char* payload; // device copy of the chunk's arrays, at the offsets of `layout`
    uint32_t feat_dim, n_offsets;
    bool grid_positions, masked_slots; // masked_slots: kModelMaskedSlots
    AnchorArrays to;
};

void uploadCuda(const UploadArgs& args, CUstream_st* stream); // asynchronous

// Returns a cudaError_t: success if the current device runs the code of this build.
int probeCuda();

} // namespace gsc
