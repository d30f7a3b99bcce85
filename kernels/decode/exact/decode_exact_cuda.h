// SPDX-License-Identifier: Apache-2.0
// Decodes and projects in the tier `exact`: in fp32 except for pixel centres, with sums in a fixed order and the
// roundings of kernels/math/projection.h. Models of the usual shape go through tiled networks, where a warp takes 16
// anchors; others take one thread per anchor and eye.
#pragma once

#include "kernels/decode/decode_cuda.h"
#include "kernels/decode/fast/fragments.h"

struct CUstream_st;

namespace gsc {

constexpr uint32_t kExactOffsets = 10;               // largest number of Gaussians per anchor that the tiles can take
constexpr uint32_t kExactInputs = kFastFeatures + 5; // inputs: features, direction, distance, level
constexpr uint32_t kExactHidden = 32;                // hidden units of a head
constexpr uint32_t kExactUnits = 3 * kExactHidden;
constexpr uint32_t kExactColumns = 128; // outputs of the second layers: 8 lane columns of 16

// Weights in the order in which the tiles read them: a row for each input. The outputs of the second layers are dealt
// out to lane columns of 16: one for opacity, five for covariance, two for colour (exactColumn()).
struct alignas(16) ExactWeights {
    float first[kExactInputs][kExactUnits];
    float first_bias[kExactUnits]; // biases of the first layer, with the appearance added
    float second[kExactHidden][kExactColumns];
    float second_bias[kExactColumns];
};

// Place of output `t` of lane column `c` in a row of the second layers: each lane of a warp reads 16 adjacent bytes.
GSC_HD uint32_t exactColumn(uint32_t c, uint32_t t)
{
    return 32 * (t / 4) + 4 * c + t % 4;
}

struct DecodeExactArgs : DecodeFrame {
    ModelView view; // model with all arrays in device memory; chunk arrays lie as in the file; `packed` is empty
    int32_t appearance;
    const ExactWeights* weights; // null for a model that takes one thread per anchor and eye
    float* scratch;              // exactScratchValues() values; null if a thread's own memory is enough
    uint32_t scratch_values;
    ExactSplat* splats; // eye_count x slot_capacity elements: the splats of each eye
};

// Returns true if the tiles can decode the model: canDecodeFast(), and at most kExactOffsets Gaussians per anchor.
bool canDecodeTiled(const ModelView& model);
// Packs the weights of a model. Preconditions: canDecodeTiled(); `model` lies in host memory; `appearance` is a row of
// its embedding, or -1.
ExactWeights packExact(const ModelView& model, int32_t appearance);

// Number of values of DecodeExactArgs::scratch for a model whose decodeScratch() is `per_thread`; 0 if none are needed,
// as with tiles.
size_t exactScratchValues(uint32_t per_thread, uint32_t processors);

// Largest number of splat slots of one eye that decoding leaves unused. tiled: DecodeExactArgs::weights is not null.
// shared_bytes: most shared memory that a block can have.
uint32_t decodeExactGaps(bool tiled, uint32_t processors, size_t shared_bytes, uint32_t slot_capacity);
void decodeExactCuda(const DecodeExactArgs& args, uint32_t processors, size_t shared_bytes,
                     CUstream_st* stream); // decodes and projects all visible anchors; asynchronous

// Used by decodeExactCuda() for models that the tiles cannot take.
void decodeExactAnyCuda(const DecodeExactArgs& args, uint32_t processors, CUstream_st* stream);

} // namespace gsc
