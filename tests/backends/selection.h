// SPDX-License-Identifier: Apache-2.0
// A backend's selection against the flat scalar pass.
#pragma once

#include "tests/kernels/synthetic_model.h"

#include <functional>
#include <vector>

namespace gsc::test {

struct Selected {
    size_t listed = 0;          // anchors that an eye sees
    size_t visible = 0;         // sum over all eyes
    size_t fading = 0;          // part of `visible`
    uint64_t groups_tested = 0; // sum over all eyes
};

// Selects for eyes, a level bias and a fade, and checks set, factors and counts.
using CheckSelection = std::function<Selected(const std::vector<EyeParams>& eyes, float lod_bias, float lod_fade)>;

// Checks of a model, which must outlive them. Defined beside the cases that are of one backend alone.
CheckSelection selectionOf(const ModelView& model);

} // namespace gsc::test
