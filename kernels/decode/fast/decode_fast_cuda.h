// SPDX-License-Identifier: Apache-2.0
// Decodes and projects in the tier `fast`: networks on the matrix units, with inputs in half precision and fp32 sums.
#pragma once

#include "kernels/decode/decode_cuda.h"

#include <vector>

struct CUstream_st;

namespace gsc {

struct DecodeCudaArgs : DecodeFrame {
    const void* fragments; // weights from packFragments()
    const float* biases;
    PackedSplat* splats;      // eye_count x slot_capacity elements: the splats of each eye
    uint32_t inverse_offsets; // inverseOffsets() of the model's n_offsets
};

// (2^32 - 1) / n_offsets, rounded down; with it the anchor of a Gaussian is found from its index without a division.
inline uint32_t inverseOffsets(uint32_t n_offsets)
{
    return ~0u / n_offsets;
}

// Weights of a model in the order in which the kernel loads them (fragments.h); the appearance is in the first bias.
struct DecodeWeights {
    std::vector<uint16_t> fragments; // weights as half floats
    std::vector<float> biases;
    std::vector<float> bank; // weights of the feature bank, empty if there is none
};

constexpr uint32_t kMostDecodeWarps = 20; // largest number of warps of a block, which leaves 96 registers to a thread

// Returns true if the matrix units can decode the model: 32 features and hidden units, at most 12 Gaussians per anchor.
bool canDecodeFast(const ModelView& model);
// Packs the weights of a model. Preconditions: canDecodeFast(); `model` lies in host memory; `appearance` is a row of
// its embedding, or -1.
DecodeWeights packFragments(const ModelView& model, int32_t appearance);

// Largest number of splat slots of one eye that decoding leaves unused.
uint32_t decodeFastGaps(uint32_t processors, uint32_t slot_capacity);
// Decode and project all visible anchors; asynchronous. shared_bytes: most shared memory that a block can have. The
// second function is for a compact model.
void decodeFastCuda(const DecodeCudaArgs& args, uint32_t processors, size_t shared_bytes, CUstream_st* stream);
void decodeCompactCuda(const DecodeCudaArgs& args, uint32_t processors, size_t shared_bytes, CUstream_st* stream);

} // namespace gsc
