// SPDX-License-Identifier: Apache-2.0
// Keys of splats, written by bin, ordered by sort and read by blend. kernels/frame/device_model.h has the pieces: bin
// cuts lists into pieces, sort orders the keys of each.
#pragma once

#include <cstdint>

namespace gsc {

struct SortKey {
    uint32_t depth_bits; // bits of view z, which as integers have the order of the depths, since these are positive
    uint32_t slot;       // slot of the splat, on a device counted over all lists
};

} // namespace gsc
