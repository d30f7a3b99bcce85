// SPDX-License-Identifier: Apache-2.0
// How far a model reaches, without what lies far away from nearly all of it.
#pragma once

#include <gsc/frame_types.h>

#include <glm/vec3.hpp>

#include <utility>

namespace gsc {

// Returns the lowest and the highest place of the model along a unit vector, world units. The twentieth of the groups
// that reaches furthest at either end does not count: far ones are sky or flaws. 0 and 0 for a model without groups.
std::pair<double, double> extentAlong(const ModelView& model, const glm::dvec3& axis);

} // namespace gsc
