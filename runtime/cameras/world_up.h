// SPDX-License-Identifier: Apache-2.0
// Finds which way is up in a model that does not say so: people hold cameras upright, or look down from the air.
#pragma once

#include <gsc/camera.h>

#include <glm/vec3.hpp>

#include <array>
#include <optional>
#include <span>

namespace gsc {

// Axes of one photograph, unit vectors of the world.
struct ViewAxes {
    glm::dvec3 right, down, forward;
};

// A unit vector of the world. Photographs are hardly ever tilted sideways: up is what their right axes are most nearly
// perpendicular to, wherever they look, straight down too. None where the right axes are too much alike to tell.
std::optional<glm::dvec3> upOfViews(std::span<const ViewAxes> views);

// upOfViews(), or the mean of the cameras' up axes where that does not tell; a unit vector of the world. A camera whose axes
// are not finite or have no length does not count. (0, -1, 0), which is up in COLMAP's axes, where none counts or where
// they disagree so much that the mean is shorter than 0.1.
std::array<double, 3> worldUp(std::span<const Camera> cameras);

} // namespace gsc
