// SPDX-License-Identifier: Apache-2.0
// Decodes anchors to Gaussians: view inputs, feature bank, three networks, activations (format facts 4). On a CPU:
// decode_cpu.cpp takes 4 to 16 anchors at a time, decode_reference.cpp one. On a device: fast/ and exact/.
#pragma once

#include "kernels/simd/buffer.h"
#include "kernels/decode/decode_body.h"
#include "kernels/select/select.h"

#include <vector>

namespace gsc {

constexpr uint32_t kDecodeBlock = 128; // visible anchors of a block: Gaussians of both eyes stay in a 1 MiB cache

constexpr uint32_t kMaxLanes = 16; // most anchors in a vector; also the length of a row in decode's scratch
constexpr uint32_t kViewRows = 5;  // rows of the fused first layer behind the features: direction, distance, level

// Gaussians of one block of anchors for one eye, as a structure of arrays; each array has room for kDecodeBlock * K
// values and a vector more.
struct GaussianBlock {
    float* position[3];
    float* scale[3];
    float* rotation[4];
    float* opacity;
    float* color[3];
    uint16_t* origin; // place of the anchor in the block * K + k, from which emissionOrder() follows
    uint32_t count;
    bool any_positive; // true if some opacity was above zero, drawn or not (format facts, trap 25)
};

// Arguments of a frame and the weights it needs; prepareDecode() fills them once per frame.
struct DecodeArgs {
    const ModelView* model;
    const EyeParams* eyes;
    uint32_t eye_count;
    const VisibleAnchor* visible;
    size_t visible_count;
    const MlpRecord* bank;   // network of the feature bank, null if there is none
    const float* first_bias; // 3 * hidden_pad biases of the fused first layer, with the appearance added
    bool takes_distance;     // true if a network reads row F + 3 of the fused first layer
    bool takes_level;        // true if a network reads row F + 4 of the fused first layer
};

struct DecodeScratch {
    Buffer<float> values;
    Buffer<uint16_t> origins;
    GaussianBlock blocks[kMaxEyes];
};

// Fills the arguments of a frame. `bias` gets the biases with the appearance added; it must outlive the arguments.
DecodeArgs prepareDecode(const ModelView& model, const EyeParams* eyes, uint32_t eye_count,
                         const VisibleAnchor* visible, size_t visible_count, int32_t appearance, Buffer<float>& bias);

// Makes `scratch` large enough for the model. Each worker needs a scratch of its own.
void reserveDecode(const ModelView& model, DecodeScratch& scratch);
// Makes the blocks of `scratch` large enough for `gaussians` Gaussians; in `scratch.values` they lie behind
// `own_values` values that decode uses itself.
void reserveBlocks(size_t gaussians, size_t own_values, DecodeScratch& scratch);

// Decodes visible anchors [first, first + count), count <= kDecodeBlock, into scratch.blocks. For each eye only
// Gaussians with opacity >= kOpacityFloor are kept, since others change no pixel. Computes in fp32 in every tier: on a
// CPU half precision saves nothing. exp, tanh and sigmoid have an error of up to 2 ulp.
void decodeBlockCpu(const DecodeArgs& args, size_t first, uint32_t count, DecodeScratch& scratch);

// Scalar reference: decodes one anchor after the other, with the weights of MLPW. Returns the Gaussians in the
// trainers' emission order if `selected` is in source order.
template <typename Real>
std::vector<GaussianOf<Real>> decodeReference(const ModelView& model, const Real* center,
                                              const std::vector<SelectedAnchor<Real>>& selected, int32_t appearance,
                                              bool& any_positive);

} // namespace gsc
