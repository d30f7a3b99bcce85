// SPDX-License-Identifier: Apache-2.0
// Checks on the arrays of weights in a section. Only for format/.
#pragma once

#include "format/validate/gsc_validate.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace gsc::validate {

struct Region {
    uint64_t offset, bytes;
    std::string pointer;
};

// Reports arrays that overlap: one value would serve two layers, which no writer produces.
template <typename Report>
void checkOverlaps(std::vector<Region>& regions, const Report& report)
{
    std::sort(regions.begin(), regions.end(), [](const Region& a, const Region& b) { return a.offset < b.offset; });
    for (size_t i = 1; i < regions.size(); ++i)
        if (regions[i].offset - regions[i - 1].offset < regions[i - 1].bytes)
            report(regions[i], regions[i - 1]);
}

// Index of the first value that is not finite, or values.size().
inline size_t finitePrefix(std::span<const float> values)
{
    if (allFinite(values))
        return values.size();
    return size_t(std::find_if(values.begin(), values.end(), [](float v) { return !std::isfinite(v); }) -
                  values.begin());
}

} // namespace gsc::validate
