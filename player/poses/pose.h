// SPDX-License-Identifier: Apache-2.0
// Position and rotation of a camera, without its lens.
#pragma once

#include <gsc/camera.h>

#include <glm/mat3x3.hpp>
#include <glm/vec3.hpp>

#include <optional>

namespace gsc {

struct CameraPose {
    glm::dvec3 position{}; // world units
    glm::dmat3 axes{1.0};  // columns right, down, forward in the world: orthonormal, right-handed
};

// The matrix nearest at hand with such columns: forward keeps its direction, right stays in its plane with down. Not
// finite where two columns are parallel.
glm::dmat3 orthonormal(const glm::dmat3& axes);

bool isFinite(const CameraPose& pose);

// True if the rotation of `camera` is a rotation up to the rounding of a camera file, 1e-3.
bool hasRotation(const Camera& camera);

// None where a number is not finite or the axes span no volume. A scale, as a transforms file may have one, goes: the
// picture stays the same but for the near plane.
std::optional<CameraPose> poseOf(const Camera& camera);

// By the rule of camera files, so that a file that states this position and rotation gives the same bits.
void setPose(const CameraPose& pose, Camera& camera);

// Position on the straight line, axes at an even rate the shorter way round. `share` 0 gives `from`, 1 gives `to`, bit
// for bit.
CameraPose between(const CameraPose& from, const CameraPose& to, double share);

} // namespace gsc
