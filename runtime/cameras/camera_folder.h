// SPDX-License-Identifier: Apache-2.0
// Cameras of a folder that a user names: what a trainer takes as its source (-s).
#pragma once

#include "runtime/cameras/camera_file.h"

#include <string>
#include <vector>

namespace gsc {

// A folder, itself no COLMAP model, that holds sparse/0 or another COLMAP model below it; transforms_train.json or
// transforms_test.json; transforms.json; or, as the folder of a trained model, cameras.json.
bool isCameraFolder(const std::string& path);
// Throws Error(Io) that says what is missing where `path` is a folder that holds no cameras.
void refuseFolderWithout(const std::string& path);

// The first of these kinds, in that order; of a pair of transforms the test's frames come first. `how` is told which one is
// taken where there are several. Precondition: isCameraFolder(). Throws as readCameraFile().
std::vector<Camera> readCameraFolder(const std::string& path, TrajectoryFacts* eyes, const CameraReading& how);

} // namespace gsc
