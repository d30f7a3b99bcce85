// SPDX-License-Identifier: Apache-2.0
// Cameras of every kind that the player accepts, and their conversion to the fp32 values that the trainers render with
// (format facts, 6).
#pragma once

#include <gsc/frame_types.h>
#include <gsc/source_camera.h>

#include <string>
#include <string_view>

namespace gsc {

// Returns a camera that a .gsc file stores; `names` is the name table of the section of cameras.
SourceCamera sourceCamera(const CameraRecord& record, std::string_view names);

// A pinhole camera in double precision.
struct Camera {
    std::string name;
    double rotation[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1}; // row-major camera-to-world; columns are right, down, forward
    double translation[3] = {}; // world to camera: view position = R^T * world position + translation
    // whole angles of view about the axis in radians; with tan_mid, those of a centred view of equal size
    double fov_x = 0, fov_y = 0;
    // Offset of the image's middle to the right of and below the axis, at depth 1: the image spans tan_mid - tan(fov /
    // 2) to tan_mid + tan(fov / 2). Not 0 for an eye of a headset, and for a photograph whose axis does not meet the
    // middle.
    double tan_mid_x = 0, tan_mid_y = 0;
    uint32_t width = 0, height = 0; // size of the picture to render, pixels
    int appearance = -1;            // row of the appearance embedding, -1 = none stated
    // focal lengths in pixels of a file that states no size; finishCamera() turns them into angles
    double focal_x = 0, focal_y = 0;
};

// Completes a camera whose file left size or angles open. `width` x `height` in pixels is the size to render: 0 for both
// takes the camera's own, 0 for one keeps its aspect. Pixels keep their shape, and the camera's whole picture is inside: at
// another aspect one axis shows more, both sides alike. `fov_x` in radians (0 = the camera's own) replaces the horizontal
// angle, which then holds at any aspect; a lens axis keeps its share of the size. Throws Error(Usage) if any stay unknown.
void finishCamera(Camera& camera, uint32_t width, uint32_t height, double fov_x);

// Computes the eye as the trainers do: world-to-camera matrix in double, inverted twice, rounded to fp32; projection P
// from the tangents in fp32; full = P * world-to-camera in fp32; centre from the inverse in fp32. `origin` is
// ModelView::origin of the model: the eye's positions are relative to it, and it is subtracted in double before
// anything is rounded. Precondition: finishCamera() was called for the camera, or it lacked nothing.
EyeParams eyeParams(const Camera& camera, const double (&origin)[3]);
EyeParams64 eyeParams64(const Camera& camera, const double (&origin)[3]);

// Makes the left and the right eye: copies of `camera`, `ipd` world units apart along its right axis.
void stereoPair(const Camera& camera, double ipd, Camera& left, Camera& right);

// View of an eye as OpenXR describes it. Axes are as everywhere: x right, y down, z forward.
struct EyeView {
    // angles of view in radians (XrFovf); left and down are below zero for most lenses
    double left = 0, right = 0, up = 0, down = 0;
    double position[3] = {}; // position of the eye in the head's axes, world units
    double rotation[9] = {}; // rotation from the eye's axes to the head's, row-major
};

// Returns the camera of an eye of `head`: place and lens come from `view`, everything else from the head.
// Preconditions: left < right, down < up, all within a right angle. Pixels are square only if the size has the lens's
// aspect.
Camera eyeOfHead(const Camera& head, const EyeView& view);

} // namespace gsc
