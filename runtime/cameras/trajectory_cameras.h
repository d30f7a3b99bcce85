// SPDX-License-Identifier: Apache-2.0
// Reads a trajectory in our own format (schemas/trajectory.schema.json).
#pragma once

#include "runtime/cameras/camera_reading.h"
#include "runtime/cameras/json_fields.h"

#include <vector>

namespace gsc {

// Returns the frames of the trajectory; fills `facts` with the values stated beside them. Throws Error(InvalidFile,
// Unsupported).
std::vector<Camera> trajectoryCameras(const JsonObject& root, TrajectoryFacts& facts, const CameraReading& how);

} // namespace gsc
