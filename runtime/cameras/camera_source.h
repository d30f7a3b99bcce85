// SPDX-License-Identifier: Apache-2.0
// Finds the cameras that a path stands for: a file, a COLMAP model, or a trainer's source folder (-s).
#pragma once

#include "runtime/cameras/camera_reading.h"

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace gsc {

enum class CameraForm : uint8_t { Json, ModelInText, ModelInBinary, ModelInBoth };

struct CameraFiles {
    std::string name; // their path, as messages name it
    CameraForm form = CameraForm::Json;
    std::filesystem::path folder; // folder of the file or of a COLMAP model
};

// Camera files at `path`. A file is taken itself, whether it is there or not; one of a COLMAP model's four files stands
// for the model in that form. A folder gives the model in it; else the first of: sparse/0 or another COLMAP model below
// it, transforms_test.json with transforms_train.json, transforms.json, transforms_val.json, cameras.json of a trained
// model. `how` is told which one is taken where there are several. Several files are read one after the other as one
// list. Throws Error(Io) that says what is missing where `path` is a folder that holds no cameras.
std::vector<CameraFiles> findCameras(const std::string& path, const CameraReading& how);

} // namespace gsc
