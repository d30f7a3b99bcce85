// SPDX-License-Identifier: Apache-2.0
// The cameras of a transforms*.json and of nerfstudio's camera_path.json, whose axes are OpenGL's.
#pragma once

#include "runtime/cameras/camera_reading.h"
#include "runtime/cameras/json_fields.h"

#include <vector>

namespace gsc {

// Both throw Error(InvalidFile, Unsupported).
std::vector<Camera> transformsCameras(const JsonObject& root, const CameraReading& how);
std::vector<Camera> nerfstudioCameras(const JsonObject& root, const CameraReading& how);

} // namespace gsc
