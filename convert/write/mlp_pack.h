// SPDX-License-Identifier: Apache-2.0
// Packs the MLPs of a model into sections: MLPW as they were trained, and MLPP with the first layers fused, transposed
// and padded, in the order in which kernels load them. The layouts are MlpRecord and PackedMlpHeader in
// format/include/gsc/gsc_layout.h.
#pragma once

#include "convert/input/checkpoint.h"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace gsc {

// Throws Error(InvalidFile) if a weight is not finite. `name` is used in messages only.
void checkMlps(std::span<const Mlp> mlps, const char* name);

// Bytes of sections MLPW and MLPP. Preconditions of both: readCheckpoint() returned the MLPs, and checkMlps() did not
// throw. A weight that is too large for a half becomes the largest finite half.
[[nodiscard]] std::vector<std::byte> canonicalMlps(std::span<const Mlp> mlps);
[[nodiscard]] std::vector<std::byte> packMlps(std::span<const Mlp> mlps, uint32_t feat_dim, uint32_t appearance_dim);

} // namespace gsc
