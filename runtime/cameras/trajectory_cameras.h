// SPDX-License-Identifier: Apache-2.0
// The cameras of a trajectory of our own (schemas/trajectory.schema.json).
#pragma once

#include "runtime/cameras/camera_reading.h"
#include "runtime/cameras/json_fields.h"

#include <vector>

namespace gsc {

// Returns its frames; fills `facts` with the values stated beside them. Throws Error(InvalidFile, Unsupported).
std::vector<Camera> trajectoryCameras(const JsonObject& root, TrajectoryFacts& facts, const CameraReading& how);

} // namespace gsc
