// SPDX-License-Identifier: Apache-2.0
// Places, directions and views of the cameras of photographs.
#pragma once

#include "convert/survey/vec3.h"
#include <gsc/source_camera.h>

#include <span>

namespace gsc {

// Camera without a name at `position` that looks along `forward` with `up` upwards.
SourceCamera lookingAlong(dvec3 position, dvec3 forward, dvec3 up, uint32_t width, uint32_t height, double fov_x);

dvec3 eyeOf(const SourceCamera& camera);
// A column of its rotation: 0 points right, 1 down, 2 forward.
dvec3 axisOf(const SourceCamera& camera, int column);

// True if `p` projects into the middle of the image, of which that is a `share` in width and height. Upstream's near
// plane, 0.2 world units, is the nearest it may lie.
bool sees(const SourceCamera& camera, dvec3 p, double share = 1);
// True if at least `least` of the cameras see `p`.
bool wellSeen(std::span<const SourceCamera> cameras, uint32_t least, dvec3 p);

} // namespace gsc
