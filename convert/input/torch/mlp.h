// SPDX-License-Identifier: Apache-2.0
// A network as the trainers save it.
#pragma once

#include <gsc/gsc_layout.h>

#include <cstdint>
#include <vector>

namespace gsc {

struct LinearLayer {
    uint32_t in = 0, out = 0;
    std::vector<float> weight; // [out][in], row-major
    std::vector<float> bias;   // [out]
};

struct Mlp {
    MlpKind kind{};
    Activation activation = Activation::None;
    uint32_t inputs = 0; // MlpInputs
    LinearLayer layers[2];
};

} // namespace gsc
