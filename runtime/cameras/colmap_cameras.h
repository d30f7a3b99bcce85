// SPDX-License-Identifier: Apache-2.0
// Cameras of a COLMAP model: a folder with cameras and images as .bin or .txt (colmap.github.io/format.html).
#pragma once

#include "runtime/cameras/camera_source.h"

#include <string>
#include <string_view>
#include <vector>

namespace gsc {

// Cameras by name, at the size of their photographs. A model in both forms is read from the binary one, as COLMAP and
// the trainers do, with a warning if the text differs. Precondition: `files` are a model's. Throws Error (Io,
// InvalidFile, Unsupported).
std::vector<Camera> readColmapCameras(const CameraFiles& files, const CameraReading& how);

// Reads the cameras from the contents of both files; `name` is used in messages. In images.txt the line of points
// behind each image may be missing: behind all of them, or, with a warning, behind some.
std::vector<Camera> parseColmapCameras(std::string_view cameras, std::string_view images, bool binary,
                                       const std::string& name, const CameraReading& how);

} // namespace gsc
