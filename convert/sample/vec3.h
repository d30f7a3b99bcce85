// SPDX-License-Identifier: Apache-2.0
// Double-precision vectors of the sample generator; also its linear RGB colours.
#pragma once

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace gsc {

constexpr double kPi = std::numbers::pi;

using Vec3 = glm::dvec3;
using glm::smoothstep;

// note: glm::mix() rounds otherwise, and a sample's bytes must stay as they are
inline Vec3 lerp(Vec3 a, Vec3 b, double t)
{
    return a + (b - a) * t;
}
inline double lerp(double a, double b, double t)
{
    return a + (b - a) * t;
}

// Zero stays zero.
inline Vec3 normalized(Vec3 a)
{
    return dot(a, a) > 0 ? glm::normalize(a) : a;
}

} // namespace gsc
