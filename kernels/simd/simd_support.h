// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace gsc {

// The instruction sets of this machine in Highway's bits, as hwy::SupportedTargets() of Highway's library gives them,
// for a player without that library. Sets above AVX-512F/BW/CD/DQ/VL (HWY_AVX3) are left out.
int64_t supportedSimdTargets();

} // namespace gsc
