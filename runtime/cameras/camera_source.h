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
    std::string name; // path of the file or model, as messages name it
    CameraForm form = CameraForm::Json;
    std::filesystem::path folder; // folder that holds the file, or the files of a COLMAP model
};

// Finds the camera files that `path` stands for. A file stands for itself, even if it does not exist; one of a COLMAP
// model's four files stands for the model in the same form (binary or text). A folder stands for the COLMAP model in
// it; else for the first of: sparse/0 or another COLMAP model below it, transforms_test.json with
// transforms_train.json, transforms.json, transforms_val.json, cameras.json of a trained model. If there are several,
// a warning in `how` says which one is taken. Several files are read one after the other as one list. Throws
// Error(Io), naming what is missing, if `path` is a folder without cameras.
std::vector<CameraFiles> findCameras(const std::string& path, const CameraReading& how);

} // namespace gsc
