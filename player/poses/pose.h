// SPDX-License-Identifier: Apache-2.0
// Position and rotation of a camera, without its lens.
#pragma once

#include <gsc/camera.h>

#include <glm/mat3x3.hpp>
#include <glm/vec3.hpp>

#include <optional>

namespace gsc {

struct CameraPose {
    glm::dvec3 position{}; // position in the world, world units
    glm::dmat3 axes{1.0};  // columns are right, down and forward in the world: orthonormal, right-handed
};

// Makes the columns orthonormal. Forward keeps its direction, and right stays in the plane of right and down. Not
// finite if two columns are parallel.
glm::dmat3 orthonormal(const glm::dmat3& axes);

bool isFinite(const CameraPose& pose);

// Returns true if the rotation of `camera` is orthonormal to within 1e-3, the rounding of camera files.
bool hasRotation(const Camera& camera);

// Pose of a camera. None if a number is not finite or the axes span no volume. A scale in the axes, which a transforms
// file may have, is removed: the picture stays the same but for the near plane.
std::optional<CameraPose> poseOf(const Camera& camera);

// Sets the pose of `camera` as the reader of camera files does, so that a file with this position and rotation gives
// the same bits.
void setPose(const CameraPose& pose, Camera& camera);

// Pose between two poses: the position lies on the straight line, and the axes turn evenly, the shorter way round.
// `share` 0 gives `from` and 1 gives `to`, bit for bit.
CameraPose between(const CameraPose& from, const CameraPose& to, double share);

} // namespace gsc
