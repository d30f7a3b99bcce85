// SPDX-License-Identifier: Apache-2.0
// Decode and projection of the tier `exact`: in fp32 but for pixel centres, sums in a fixed order, the roundings of
// kernels/math/projection.h. Models of the usual shape go through tiled networks, a warp to 16 anchors; any other
// through one thread per anchor and eye.
#pragma once

#include "kernels/decode/decode_cuda.h"
#include "kernels/decode/fast/fragments.h"

struct CUstream_st;

namespace gsc {

constexpr uint32_t kExactOffsets = 10;               // Gaussians per anchor at most, in tiles
constexpr uint32_t kExactInputs = kFastFeatures + 5; // features, direction, distance, level
constexpr uint32_t kExactHidden = 32;                // units of a head
constexpr uint32_t kExactUnits = 3 * kExactHidden;
constexpr uint32_t kExactColumns = 128; // columns of the second layers: 8 lane columns of 16 outputs

// Weights as the tiles read them: a row per input. The second layers' outputs are dealt to lane columns of 16, one for
// opacity, five for covariance, two for colour (exactColumn()).
struct alignas(16) ExactWeights {
    float first[kExactInputs][kExactUnits];
    float first_bias[kExactUnits]; // with the appearance folded in
    float second[kExactHidden][kExactColumns];
    float second_bias[kExactColumns];
};

// Place of output `t` of lane column `c` in a row of the second layers: so the lanes of a warp read 16 adjacent bytes
// each.
GSC_HD uint32_t exactColumn(uint32_t c, uint32_t t)
{
    return 32 * (t / 4) + 4 * c + t % 4;
}

struct DecodeExactArgs : DecodeFrame {
    ModelView view; // everything in device memory, chunk arrays as they lie in the file; no `packed`
    int32_t appearance;
    const ExactWeights* weights; // null: one thread per anchor and eye
    float* scratch;              // exactScratchValues(), or null where a thread's own memory is enough
    uint32_t scratch_values;
    ExactSplat* splats; // eye_count x slot_capacity
};

// True if the tiles can decode the model (canDecodeFast(), and at most kExactOffsets Gaussians per anchor).
bool canDecodeTiled(const ModelView& model);
// Preconditions: canDecodeTiled(); `model` lies in host memory; `appearance` is a row it has, or -1.
ExactWeights packExact(const ModelView& model, int32_t appearance);

// Values of DecodeExactArgs::scratch that a model of `per_thread` = decodeScratch() needs; 0 = none, as with tiles.
size_t exactScratchValues(uint32_t per_thread, uint32_t processors);

// Slots that may stay unused beside those of the splats, for one eye. tiled: DecodeExactArgs::weights is not null.
// shared_bytes: most shared memory of a block.
uint32_t decodeExactGaps(bool tiled, uint32_t processors, size_t shared_bytes, uint32_t slot_capacity);
void decodeExactCuda(const DecodeExactArgs& args, uint32_t processors, size_t shared_bytes,
                     CUstream_st* stream); // asynchronous

// Part of the above.
void decodeExactAnyCuda(const DecodeExactArgs& args, uint32_t processors, CUstream_st* stream);

} // namespace gsc
