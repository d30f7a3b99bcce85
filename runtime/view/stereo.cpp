// SPDX-License-Identifier: Apache-2.0
#include "runtime/view/stereo.h"

#include <algorithm>
#include <cmath>

namespace gsc {

bool sameDepths(const EyeParams& left, const EyeParams& right)
{
    // relative tolerances: a value was rounded once, from double; a sum that cancels keeps the rounding of its parts
    // in double
    constexpr float kRounded = 1.3e-7f, kCancelled = 1e-12f;
    const float *l = left.world_to_view + 8, *r = right.world_to_view + 8;
    float parts = 0;
    for (int i = 0; i < 3; ++i)
        parts += std::abs(left.center[i]) + std::abs(right.center[i]);
    const auto same = [](float a, float b, float rest) {
        return std::abs(a - b) <= kRounded * std::max(std::abs(a), std::abs(b)) + rest;
    };
    return same(l[0], r[0], kCancelled) && same(l[1], r[1], kCancelled) && same(l[2], r[2], kCancelled) &&
           same(l[3], r[3], kCancelled * parts);
}

} // namespace gsc
