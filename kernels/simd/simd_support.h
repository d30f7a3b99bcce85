// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace gsc {

// Instruction sets of this machine, as the bits that hwy::SupportedTargets() of Highway's library returns; for a player
// without that library. Sets above AVX-512F/BW/CD/DQ/VL (HWY_AVX3) are left out.
int64_t supportedSimdTargets();

} // namespace gsc
