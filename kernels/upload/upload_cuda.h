// SPDX-License-Identifier: Apache-2.0
// Copies the payload of a chunk, as it lies in the file, to the flat arrays that the CUDA stages read.
#pragma once

#include "kernels/frame/device_model.h"

struct CUstream_st;

namespace gsc {

// Device arrays of the whole model, to which a DeviceModel points.
struct AnchorArrays {
    float *placement, *size, *shape;
    float* rotation; // null if the model has no rotations
    uint32_t* source;
    uint16_t* feature;           // null in a compact model
    uint64_t* offset;            // null in a compact model
    CompactShape* compact_shape; // sizes of the anchors of a compact model, null in other models
    uint32_t *compact_feature, *compact_offset;
};

struct UploadArgs {
    ChunkRecord chunk;
    LevelRecord level;
    ChunkArrayLayout layout;
    const unsigned char* payload; // the chunk's arrays in device memory, at the offsets in `layout`
    uint32_t feat_dim, n_offsets;
    bool grid_positions, masked_slots; // masked_slots: the model has kModelMaskedSlots
    AnchorArrays to;
};

void uploadCuda(const UploadArgs& args, CUstream_st* stream); // converts the payload of one chunk; asynchronous

// Returns a cudaError_t, cudaSuccess if the current device can run the code of this build.
int probeCuda();

} // namespace gsc
