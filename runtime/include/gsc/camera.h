// SPDX-License-Identifier: Apache-2.0
// Cameras of every kind the player accepts, brought to the fp32 values upstream renders with (format facts, 6).
#pragma once

#include <gsc/frame_types.h>
#include <gsc/source_camera.h>

#include <string>
#include <string_view>

namespace gsc {

// Camera as a .gsc stores it; `names` is the name table of its section.
SourceCamera sourceCamera(const CameraRecord& record, std::string_view names);

// A pinhole camera, double precision.
struct Camera {
    std::string name;
    double rotation[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1}; // row-major camera-to-world; columns are right, down, forward
    double translation[3] = {};                       // world-to-camera: t of view = R^T * world + t
    double fov_x = 0, fov_y = 0; // radians, whole angles about the axis; with tan_mid, of a centred view as large
    // Offset of the image's middle, right and down of the axis, at depth 1: the image spans tan_mid - tan(fov / 2) to
    // tan_mid + tan(fov / 2). Not 0 in an eye of a headset and in a photograph whose axis meets another pixel.
    double tan_mid_x = 0, tan_mid_y = 0;
    uint32_t width = 0, height = 0;  // pixels to render
    int appearance = -1;             // embedding row, -1 = none stated
    double focal_x = 0, focal_y = 0; // pixels, where the file states no size; finishCamera() turns them into angles
};

// Fills in what a camera file left open. `width` x `height` (0 = the camera's own) is the size to render; it cuts
// nothing and stretches nothing if its aspect is the camera's, otherwise the horizontal field of view holds and rows
// come or go at top and bottom alike. `fov_x` (radians, 0 = the camera's own) overrides the angle; the axis keeps its
// pixel of the camera's own size. Throws Error(Usage) if size or angle remain unknown.
void finishCamera(Camera& camera, uint32_t width, uint32_t height, double fov_x);

// Upstream's arithmetic: W2C in double, inverted twice, rounded to fp32; P from the tangents in fp32; full = P * W2C
// in fp32; centre from the fp32 inverse. `origin` is the ModelView::origin of the model to be seen: the world the eye is
// in starts there, taken off in double before anything is rounded. Precondition: finishCamera() was called or nothing
// was open.
EyeParams eyeParams(const Camera& camera, const double (&origin)[3]);
EyeParams64 eyeParams64(const Camera& camera, const double (&origin)[3]);

// Left and right eye of `camera`, `ipd` world units apart along its right axis, otherwise alike.
void stereoPair(const Camera& camera, double ipd, Camera& left, Camera& right);

// An eye as OpenXR describes it. Axes as everywhere: x right, y down, z forward.
struct EyeView {
    double left = 0, right = 0, up = 0, down = 0; // XrFovf: radians, left and down below zero for most lenses
    double position[3] = {};                      // in the head's axes, world units
    double rotation[9] = {};                      // row-major eye-to-head
};

// The eye of a head at `head`: its place and lens are the view's, everything else is the head's. left < right and
// down < up, all within a right angle. Pixels come out square only if the size has the lens's aspect.
Camera eyeOfHead(const Camera& head, const EyeView& view);

} // namespace gsc
