// SPDX-License-Identifier: Apache-2.0
// A small network (MLP) as the trainers save it.
#pragma once

#include <gsc/gsc_layout.h>

#include <cstdint>
#include <vector>

namespace gsc {

struct LinearLayer {
    uint32_t in = 0, out = 0;
    std::vector<float> weight; // weights [out][in], row by row
    std::vector<float> bias;   // `out` values
};

struct Mlp {
    MlpKind kind{};
    Activation activation = Activation::None;
    uint32_t inputs = 0; // bit mask of MlpInputs
    LinearLayer layers[2];
};

} // namespace gsc
