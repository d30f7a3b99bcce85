// SPDX-License-Identifier: Apache-2.0
// Cameras for the tests of what a person moves.
#pragma once

#include "player/poses/pose.h"

#include <glm/gtc/quaternion.hpp>

namespace gsc {

// At `position`, axes those of the world.
inline Camera windowCamera(const glm::dvec3& position)
{
    Camera camera;
    camera.fov_x = 1.5;
    camera.fov_y = 1.1;
    camera.width = 1280;
    camera.height = 720;
    setPose({position, glm::dmat3(1.0)}, camera);
    return camera;
}

// windowCamera(), turned right by `heading`, then up by `pitch`, then clockwise by `roll`, as far as the axes of COLMAP
// have it; radians.
inline Camera turnedCamera(const glm::dvec3& position, double heading, double pitch, double roll = 0)
{
    const glm::dquat turn = glm::angleAxis(heading, glm::dvec3(0, 1, 0)) * glm::angleAxis(pitch, glm::dvec3(1, 0, 0)) *
                            glm::angleAxis(roll, glm::dvec3(0, 0, 1));
    Camera camera = windowCamera(position);
    setPose({position, glm::mat3_cast(turn)}, camera);
    return camera;
}

} // namespace gsc
