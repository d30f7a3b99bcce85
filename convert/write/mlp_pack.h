// SPDX-License-Identifier: Apache-2.0
// The MLPs of a model as sections: MLPW (canonical, as trained) and MLPP (fused, transposed, padded, in the order
// the kernels load). The layout is PackedMlpHeader's and MlpRecord's in format/include/gsc/gsc_layout.h.
#pragma once

#include "convert/input/checkpoint.h"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace gsc {

// Throws Error(InvalidFile) for weights that are not finite; `name` is used in messages only.
void checkMlps(std::span<const Mlp> mlps, const char* name);

// Preconditions of both: readCheckpoint() gave the MLPs, and checkMlps() passed. A weight that is too large for a
// half becomes the largest finite one.
[[nodiscard]] std::vector<std::byte> canonicalMlps(std::span<const Mlp> mlps);
[[nodiscard]] std::vector<std::byte> packMlps(std::span<const Mlp> mlps, uint32_t feat_dim, uint32_t appearance_dim);

} // namespace gsc
