// SPDX-License-Identifier: Apache-2.0
// Reads the camera files that the player and the converter accept.
#pragma once

#include "runtime/cameras/camera_reading.h"

#include <string>
#include <string_view>
#include <vector>

namespace gsc {

// Reads the trainers' cameras.json, a transforms*.json, nerfstudio's camera_path.json, or our trajectory
// (schemas/trajectory.schema.json), told apart by their content.
//
// Sizes are those in the file, but for a cameras.json at most 1600 pixels wide (format facts, section 6.2). If the
// file states no size, width and height are 0, and finishCamera() then takes the size from the command line. cx and cy
// (pixels of the stated size) move the image off the axis: Camera::tan_mid_x, tan_mid_y.
//
// `eyes`, if not null, receives the statements of a trajectory beside its frames, and whether the cameras are a path:
// those of a trajectory and of a camera_path.json are. Without `eyes`, a trajectory that states a view for each eye is
// refused, because its cameras alone do not show the same.
//
// Every key is used, or a warning in `how.warnings` says that it has no effect, or it concerns neither poses nor
// lenses. A warning tells of keys that contradict each other, and which was used. Throws Error (InvalidFile,
// Unsupported).
std::vector<Camera> parseCameraFile(std::string_view json, const std::string& name, TrajectoryFacts* eyes = nullptr,
                                    const CameraReading& how = {});
// Reads the cameras of a file as parseCameraFile() does, of a COLMAP model (colmap_cameras.h), or of a folder
// (camera_source.h). Warns in `how` of a cfg_args beside a cameras.json that states another size. Throws Error (Io,
// InvalidFile, Unsupported).
std::vector<Camera> readCameraFile(const std::string& path, TrajectoryFacts* eyes = nullptr,
                                   const CameraReading& how = {});

} // namespace gsc
