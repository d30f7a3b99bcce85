// SPDX-License-Identifier: Apache-2.0
// Decode and projection of the tier `fast`: networks on the matrix units, halves in, fp32 sums.
#pragma once

#include "kernels/decode/decode_cuda.h"

#include <vector>

struct CUstream_st;

namespace gsc {

struct DecodeCudaArgs : DecodeFrame {
    const void* fragments; // packFragments()
    const float* biases;
    PackedSplat* splats;      // eye_count x slot_capacity
    uint32_t inverse_offsets; // inverseOffsets()
};

// (2^32 - 1) / n_offsets, rounded down: from the index of a Gaussian to its anchor without a division.
inline uint32_t inverseOffsets(uint32_t n_offsets)
{
    return ~0u / n_offsets;
}

// Weights of a model in the order the kernel loads them (fragments.h); appearance folded into the first bias.
struct DecodeWeights {
    std::vector<uint16_t> fragments; // halves
    std::vector<float> biases;
    std::vector<float> bank; // empty: no feature bank
};

constexpr uint32_t kMostDecodeWarps = 20; // warps of a block: 96 registers a thread

// True if the matrix-unit kernel can decode the model (32 features and hidden units, at most 12 Gaussians per anchor).
bool canDecodeFast(const ModelView& model);
// Preconditions: canDecodeFast(); `model` lies in host memory; `appearance` is a row it has, or -1.
DecodeWeights packFragments(const ModelView& model, int32_t appearance);

// Slots that may stay unused beside those of the splats, for one eye.
uint32_t decodeFastGaps(uint32_t processors, uint32_t slot_capacity);
// Asynchronous. shared_bytes: most shared memory of a block. The second is for a compact model.
void decodeFastCuda(const DecodeCudaArgs& args, uint32_t processors, size_t shared_bytes, CUstream_st* stream);
void decodeCompactCuda(const DecodeCudaArgs& args, uint32_t processors, size_t shared_bytes, CUstream_st* stream);

} // namespace gsc
