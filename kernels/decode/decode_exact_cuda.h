// SPDX-License-Identifier: Apache-2.0
// Decode and projection in fp32, the scalar arithmetic of the reference, one thread per anchor and eye. For the tier
// `exact` and for models the matrix-unit kernel does not take.
#pragma once

#include "kernels/decode/decode_cuda.h"

namespace gsc {

struct DecodeExactArgs : DecodeFrame {
    ModelView view; // everything in device memory, chunk arrays as they lie in the file; no `packed`
    int32_t appearance;
    float* scratch; // exactScratchValues(), or null where a thread's own memory is enough
    uint32_t scratch_values;
    ExactSplat* splats; // eye_count x slot_capacity
};

// Values of DecodeExactArgs::scratch that a model of `per_thread` = decodeScratch() needs; 0 = none.
size_t exactScratchValues(uint32_t per_thread, uint32_t processors);

void decodeExactCuda(const DecodeExactArgs& args, uint32_t processors, CUstream_st* stream); // asynchronous

} // namespace gsc
