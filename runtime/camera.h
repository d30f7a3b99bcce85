// SPDX-License-Identifier: Apache-2.0
// Cameras of every kind the player accepts, brought to the fp32 values upstream renders with (format facts, 6).
#pragma once

#include "kernels/common/frame_types.h"

#include <string>
#include <vector>

namespace gsc {

// A pinhole camera with the principal point in the image centre, double precision.
struct Camera {
    std::string name;
    double rotation[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1}; // row-major camera-to-world; columns are right, down, forward
    double translation[3] = {};                       // world-to-camera: t of view = R^T * world + t
    double fov_x = 0, fov_y = 0;                      // radians, whole angles
    uint32_t width = 0, height = 0;                   // pixels to render
    int appearance = -1;                              // embedding row, -1 = none stated
    double focal_x = 0, focal_y = 0; // pixels, where the file states no size; finishCamera() turns them into angles
};

// Fills in what a camera file left open. `width` x `height` (0 = the camera's own) is the size to render; it cuts
// nothing and stretches nothing if its aspect is the camera's, otherwise the horizontal field of view holds.
// `fov_x` (radians, 0 = the camera's own) overrides the angle. Throws Error(Usage) if size or angle remain unknown.
void finishCamera(Camera& camera, uint32_t width, uint32_t height, double fov_x);

// Upstream's arithmetic: W2C in double, inverted twice, rounded to fp32; P from the tangents in fp32; full = P * W2C
// in fp32; centre from the fp32 inverse. Precondition: finishCamera() was called or nothing was open.
EyeParams eyeParams(const Camera& camera);
EyeParams64 eyeParams64(const Camera& camera);

// Left and right eye of `camera`, `ipd` world units apart along its right axis, otherwise alike.
void stereoPair(const Camera& camera, double ipd, Camera& left, Camera& right);

} // namespace gsc
