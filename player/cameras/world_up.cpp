// SPDX-License-Identifier: Apache-2.0
#include "player/cameras/world_up.h"

#include <cmath>
#include <cstddef>

namespace gsc {

namespace {

constexpr double kLeastAgreement = 0.1; // length of the mean: of random directions it is shorter from some hundred on

} // namespace

std::array<double, 3> worldUp(std::span<const Camera> cameras)
{
    double sum[3] = {};
    size_t counted = 0;
    for (const Camera& camera : cameras) {
        const double* const r = camera.rotation;
        const double down[3] = {r[1], r[4], r[7]};
        const double length = std::hypot(down[0], down[1], down[2]);
        if (!std::isfinite(length) || !(length > 0))
            continue;
        for (size_t i = 0; i < 3; ++i)
            sum[i] -= down[i] / length;
        ++counted;
    }
    const double length = std::hypot(sum[0], sum[1], sum[2]);
    if (counted == 0 || length < kLeastAgreement * double(counted))
        return {0, -1, 0};
    return {sum[0] / length, sum[1] / length, sum[2] / length};
}

} // namespace gsc
