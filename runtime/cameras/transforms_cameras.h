// SPDX-License-Identifier: Apache-2.0
// Reads the cameras of a transforms*.json and of nerfstudio's camera_path.json, which have OpenGL's axes.
#pragma once

#include "runtime/cameras/camera_reading.h"
#include "runtime/cameras/json_fields.h"

#include <vector>

namespace gsc {

// Return the cameras of a parsed transforms*.json, and of a parsed camera_path.json. Throw Error(InvalidFile,
// Unsupported).
std::vector<Camera> transformsCameras(const JsonObject& root, const CameraReading& how);
std::vector<Camera> nerfstudioCameras(const JsonObject& root, const CameraReading& how);

} // namespace gsc
