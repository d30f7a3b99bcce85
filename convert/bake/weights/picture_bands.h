// SPDX-License-Identifier: Apache-2.0
// Splits a picture of a large model into bands of columns that are drawn one after another. The pixels stay the same,
// and the memory for Gaussians (110 to 160 bytes per slot in sight in a city) does not grow with the model.
#pragma once

#include <gsc/frame_types.h>

#include <algorithm>
#include <cstdint>
#include <vector>

namespace gsc {

constexpr uint64_t kMostSlotsAtOnce = uint64_t(1) << 23; // slots in sight; they take 0.9 to 1.3 GB

// Bands in each of which about `most` of the `slots` in sight can be seen; one band of all columns if `slots` is not
// above `most`.
inline std::vector<ColumnRange> pictureBands(uint32_t width, uint64_t slots, uint64_t most = kMostSlotsAtOnce)
{
    const uint64_t steps = (width + kColumnStep - 1) / kColumnStep;
    const uint64_t count = std::clamp<uint64_t>((slots + most - 1) / most, 1, std::max<uint64_t>(steps, 1));
    if (count == 1)
        return {ColumnRange{}};
    std::vector<ColumnRange> bands;
    for (uint64_t b = 0; b < count; ++b)
        bands.push_back({uint32_t(b * steps / count) * kColumnStep, uint32_t((b + 1) * steps / count) * kColumnStep});
    return bands;
}

} // namespace gsc
