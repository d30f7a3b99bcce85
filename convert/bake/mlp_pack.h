// SPDX-License-Identifier: Apache-2.0
// The MLPs of a model as sections: MLPW (canonical, as trained) and MLPP (fused, transposed, padded, in the order
// the kernels load). The layout is PackedMlpHeader's and MlpRecord's in format/gsc_layout.h.
#pragma once

#include "convert/input/checkpoint.h"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace gsc {

// IEEE binary16 of `value`, nearest even; finite values that are too large become the largest finite half, since one
// infinite weight would turn whole images into NaN.
[[nodiscard]] uint16_t floatToHalf(float value);

// Throws Error(InvalidFile) if `mlps` are not opacity, covariance, colour and possibly the feature bank, in that order,
// with `feat_dim` hidden units, the inputs MlpInputs describes, and finite weights; `name` is used in messages only.
void checkMlps(std::span<const Mlp> mlps, uint32_t feat_dim, uint32_t n_offsets, uint32_t appearance_dim,
               const char* name);

// Preconditions of both: checkMlps() passed.
[[nodiscard]] std::vector<std::byte> canonicalMlps(std::span<const Mlp> mlps);
[[nodiscard]] std::vector<std::byte> packMlps(std::span<const Mlp> mlps, uint32_t feat_dim, uint32_t appearance_dim);

} // namespace gsc
