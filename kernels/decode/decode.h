// SPDX-License-Identifier: Apache-2.0
// Anchors to Gaussians: view inputs, feature bank, three networks, post-processing (format facts 4). On a CPU: decode_cpu.cpp,
// 4 to 16 anchors at a time, and decode_reference.cpp, one. On a device: fast/ and exact/.
#pragma once

#include "kernels/simd/buffer.h"
#include "kernels/decode/decode_body.h"
#include "kernels/select/select.h"

#include <vector>

namespace gsc {

constexpr uint32_t kDecodeBlock = 128; // visible anchors per block: its Gaussians of both eyes stay in a 1 MiB cache

constexpr uint32_t kMaxLanes = 16; // anchors per vector, and the row length of decode's scratch
constexpr uint32_t kViewRows = 5;  // rows of the fused first layer after the features: direction, distance, level

// Gaussians of one block and one eye, structure of arrays; every array holds kDecodeBlock * K values plus a vector.
struct GaussianBlock {
    float* position[3];
    float* scale[3];
    float* rotation[4];
    float* opacity;
    float* color[3];
    uint16_t* origin; // entry of the block * K + k: leads to emissionOrder()
    uint32_t count;
    bool any_positive; // an opacity above zero existed, drawn or not (trap 25)
};

// Arguments of a frame, and the weights it needs; prepareDecode() fills them once a frame.
struct DecodeArgs {
    const ModelView* model;
    const EyeParams* eyes;
    uint32_t eye_count;
    const VisibleAnchor* visible;
    size_t visible_count;
    const MlpRecord* bank;   // the feature bank's network, or null
    const float* first_bias; // 3 * hidden_pad: biases of the fused first layer with the appearance folded in
    bool takes_distance;     // a network reads row F + 3 of the fused first layer
    bool takes_level;        // a network reads row F + 4
};

struct DecodeScratch {
    Buffer<float> values;
    Buffer<uint16_t> origins;
    GaussianBlock blocks[kMaxEyes];
};

// `bias` receives the folded biases and must outlive the args.
DecodeArgs prepareDecode(const ModelView& model, const EyeParams* eyes, uint32_t eye_count,
                         const VisibleAnchor* visible, size_t visible_count, int32_t appearance, Buffer<float>& bias);

// Makes `scratch` fit the model. One scratch per worker.
void reserveDecode(const ModelView& model, DecodeScratch& scratch);
// Sizes its blocks for `gaussians` Gaussians, behind `own_values` values of decode's own.
void reserveBlocks(size_t gaussians, size_t own_values, DecodeScratch& scratch);

// Decodes visible anchors [first, first + count), count <= kDecodeBlock, into scratch.blocks. Per eye only Gaussians
// with opacity >= kOpacityFloor are kept: no other can change a pixel. fp32 in every tier: on a CPU half precision
// saves nothing, and exp, tanh and sigmoid are good to 2 ulp.
void decodeBlockCpu(const DecodeArgs& args, size_t first, uint32_t count, DecodeScratch& scratch);

// Scalar, one anchor after the other, from the canonical weights. Returns the Gaussians in upstream's emission order
// if `selected` is in source order.
template <typename Real>
std::vector<GaussianOf<Real>> decodeReference(const ModelView& model, const Real* center,
                                              const std::vector<SelectedAnchor<Real>>& selected, int32_t appearance,
                                              bool& any_positive);

} // namespace gsc
