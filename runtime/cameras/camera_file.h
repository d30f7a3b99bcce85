// SPDX-License-Identifier: Apache-2.0
// Reads the camera files that the player and the converter accept.
#pragma once

#include "runtime/cameras/camera_reading.h"

#include <string>
#include <string_view>
#include <vector>

namespace gsc {

// Upstream's cameras.json, a transforms*.json, nerfstudio's camera_path.json, or our trajectory
// (schemas/trajectory.schema.json), told apart by content. Sizes are those of the file, for a cameras.json at most 1600
// pixels wide (section 6.2). A file that states no size leaves width and height 0: finishCamera() then takes it from the command line.
// `eyes`, if given, takes what a trajectory states beside its frames, and whether they are a path: a trajectory and a
// camera_path.json are. Without it, a trajectory that gives the eyes
// views of their own is refused, because its cameras alone are not what it shows.
// cx and cy (pixels of the stated size) move the image off the axis: Camera::tan_mid_x, tan_mid_y.
// Every key is honoured, said to have no effect in `how.warnings`, or says nothing of poses and lenses. Keys that
// contradict each other are told there with what was taken.
// Throws Error (InvalidFile, Unsupported).
std::vector<Camera> parseCameraFile(std::string_view json, const std::string& name, TrajectoryFacts* eyes = nullptr,
                                    const CameraReading& how = {});
// Reads cameras of a file as parseCameraFile(), of a COLMAP model (colmap_cameras.h) or of a folder (camera_source.h).
// Warns, in `how`, of a cfg_args beside a cameras.json that states another size. Throws Error (Io, InvalidFile,
// Unsupported).
std::vector<Camera> readCameraFile(const std::string& path, TrajectoryFacts* eyes = nullptr,
                                   const CameraReading& how = {});

} // namespace gsc
