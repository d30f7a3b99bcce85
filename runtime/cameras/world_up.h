// SPDX-License-Identifier: Apache-2.0
// Finds which way is up in a model that does not state it: people hold cameras upright, or look down from the air.
#pragma once

#include <gsc/camera.h>

#include <glm/vec3.hpp>

#include <array>
#include <optional>
#include <span>

namespace gsc {

// Axes of one photograph's camera, as unit vectors in the world.
struct ViewAxes {
    glm::dvec3 right, down, forward;
};

// Finds up as a unit vector in the world. Photographs are hardly ever tilted sideways, so up is the direction that is
// most nearly perpendicular to all right axes, wherever the cameras look, even straight down. None if the right axes
// are too much alike to tell.
std::optional<glm::dvec3> upOfViews(std::span<const ViewAxes> views);

// Returns upOfViews(), or, if that finds none, the mean of the cameras' up axes, as a unit vector in the world. A
// camera whose axes are not finite or have no length does not count. Returns (0, -1, 0), which is up in COLMAP's axes,
// if no camera counts or the mean is shorter than 0.1.
std::array<double, 3> worldUp(std::span<const Camera> cameras);

} // namespace gsc
