// SPDX-License-Identifier: Apache-2.0
// Positions, axes and views of cameras.
#pragma once

#include "convert/survey/vec3.h"
#include <gsc/source_camera.h>

#include <span>

namespace gsc {

// Camera without a name at `position` that looks along `forward`, with `up` pointing upwards in its picture.
SourceCamera lookingAlong(dvec3 position, dvec3 forward, dvec3 up, uint32_t width, uint32_t height, double fov_x);

dvec3 eyeOf(const SourceCamera& camera);
// Axis of a camera in world space: 0 points right, 1 down, 2 forward.
dvec3 axisOf(const SourceCamera& camera, int column);

// Returns true if the camera sees `p` in the middle `share` (0 to 1) of the width and height of its picture, at least
// 0.2 world units away (the trainers' near plane).
bool sees(const SourceCamera& camera, dvec3 p, double share = 1);
// Returns true if at least `least` of the cameras see `p`.
bool wellSeen(std::span<const SourceCamera> cameras, uint32_t least, dvec3 p);

} // namespace gsc
