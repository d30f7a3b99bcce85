// SPDX-License-Identifier: Apache-2.0
// A chunk payload, as it lies in the file, into the flat arrays the CUDA stages read.
#pragma once

#include "kernels/frame/device_model.h"

struct CUstream_st;

namespace gsc {

struct UploadArgs {
    ChunkRecord chunk;
    LevelRecord level;
    ChunkArrayLayout layout;
    const unsigned char* payload; // device copy of the chunk's arrays, at the offsets of `layout`
    uint32_t feat_dim, n_offsets;
    bool grid_positions;
    float* placement; // see DeviceModel; all are the whole model's arrays
    float* size;
    float* shape;
    float* rotation;   // or null
    uint16_t* feature; // or null
    uint64_t* offset;  // or null
    uint32_t* source;
};

void uploadCuda(const UploadArgs& args, CUstream_st* stream); // asynchronous

// A cudaError_t: does the current device run the code of this build?
int probeCuda();

} // namespace gsc
