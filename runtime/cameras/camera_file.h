// SPDX-License-Identifier: Apache-2.0
// The camera files the player and the converter accept.
#pragma once

#include "runtime/cameras/camera_reading.h"
#include <gsc/camera.h>

#include <string>
#include <string_view>
#include <vector>

namespace gsc {

// t = -R^T p: Camera::translation of a camera at p (world) with Camera::rotation R. Everything that knows a position goes
// through here, so that the same position gives the same bits.
void translationFromPosition(const double rotation[9], const double position[3], double out[3]);

// Upstream's cameras.json, without appearance and split, of which it says nothing. `name` is used in messages only.
// Throws Error (InvalidFile, Unsupported).
std::vector<SourceCamera> parseUpstreamCameras(std::string_view json, const std::string& name,
                                               const CameraReading& how = {});

// What upstream renders for it by default: field of view of the source size, at most 1600 pixels wide (6.2).
// Precondition: as parseUpstreamCameras() leaves it.
Camera cameraOf(const SourceCamera& source);

// What a trajectory states beside its frames. With views, a frame is the pose of the head.
struct TrajectoryFacts {
    std::string name;           // empty = not stated
    double ipd = 0;             // world units, 0 = not stated
    std::vector<EyeView> views; // left eye first; empty = not stated
};

// Upstream's cameras.json, a transforms*.json, nerfstudio's camera_path.json, or our trajectory
// (schemas/trajectory.schema.json), told apart by content. Sizes are those of the file, for a cameras.json at most 1600
// pixels wide (section 6.2). A file that states no size leaves width and height 0: finishCamera() then takes it from the command line.
// `eyes`, if given, takes what a trajectory states beside its frames. Without it, a trajectory that gives the eyes
// views of their own is refused, because its cameras alone are not what it shows.
// cx and cy (pixels of the stated size) move the image off the axis: Camera::tan_mid_x, tan_mid_y.
// Every key is honoured, said to have no effect in `how.warnings`, or says nothing of poses and lenses. Keys that
// contradict each other are told there with what was taken.
// Throws Error (InvalidFile, Unsupported).
std::vector<Camera> parseCameraFile(std::string_view json, const std::string& name, TrajectoryFacts* eyes = nullptr,
                                    const CameraReading& how = {});
// The same of a file, the cameras of a COLMAP model (colmap_cameras.h) or what a folder holds (camera_folder.h). `how`
// is told of a cfg_args beside a cameras.json that states another size. Throws Error (Io, InvalidFile, Unsupported).
std::vector<Camera> readCameraFile(const std::string& path, TrajectoryFacts* eyes = nullptr,
                                   const CameraReading& how = {});

} // namespace gsc
