// SPDX-License-Identifier: Apache-2.0
// Double-precision vectors for the survey and the sample generator, which uses them for linear RGB colours, too.
#pragma once

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace gsc {

constexpr double kPi = std::numbers::pi;

using glm::dvec3;
using glm::smoothstep;

// note: not glm::mix(), which rounds differently, because the bytes of a sample must not change
inline dvec3 lerp(dvec3 a, dvec3 b, double t)
{
    return a + (b - a) * t;
}
inline double lerp(double a, double b, double t)
{
    return a + (b - a) * t;
}

// Unit vector; the zero vector stays zero.
inline dvec3 normalized(dvec3 a)
{
    return dot(a, a) > 0 ? glm::normalize(a) : a;
}

} // namespace gsc
