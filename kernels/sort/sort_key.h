// SPDX-License-Identifier: Apache-2.0
// Keys of splats: sort owns them, bin and blend read them. Pieces of lists lie in kernels/frame/device_model.h, whose
// counters are theirs: bin cuts them, sort orders the keys of each.
#pragma once

#include <cstdint>

namespace gsc {

struct SortKey {
    uint32_t depth_bits; // view z, whose bits order like it because it is positive
    uint32_t slot;       // slot of the splat; on a device counted over all lists
};

} // namespace gsc
