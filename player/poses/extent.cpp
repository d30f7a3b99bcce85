// SPDX-License-Identifier: Apache-2.0
#include "player/poses/extent.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

namespace gsc {

std::pair<double, double> extentAlong(const ModelView& model, const glm::dvec3& axis)
{
    constexpr double kOutside = 0.05; // share of the groups at either end that do not count
    const uint64_t count = model.params->group_count;
    if (count == 0)
        return {0, 0};
    std::vector<double> lows, highs;
    for (uint64_t i = 0; i < count; ++i) {
        const GroupRecord& group = model.groups[i];
        double middle = 0, reach = 0;
        for (int a = 0; a < 3; ++a) {
            const double low = double(group.anchor_min[a]), high = double(group.anchor_max[a]);
            middle += axis[a] * ((low + high) / 2 + model.origin[a]);
            reach += std::abs(axis[a]) * (high - low) / 2;
        }
        lows.push_back(middle - reach);
        highs.push_back(middle + reach);
    }
    const auto outside = ptrdiff_t(kOutside * double(count));
    std::nth_element(lows.begin(), lows.begin() + outside, lows.end());
    std::nth_element(highs.begin(), highs.end() - 1 - outside, highs.end());
    return {lows[size_t(outside)], *(highs.end() - 1 - outside)};
}

} // namespace gsc
