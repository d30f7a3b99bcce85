// SPDX-License-Identifier: Apache-2.0
// Reads cameras of a COLMAP model: a folder with cameras and images as .bin or .txt (colmap.github.io/format.html).
#pragma once

#include "runtime/cameras/camera_source.h"

#include <string>
#include <string_view>
#include <vector>

namespace gsc {

// Returns the cameras in the order of their names, in the size of their photographs. A model in both forms is read
// from the binary files, as COLMAP and the trainers do, with a warning if the text files differ. Precondition: `files`
// are those of a model. Throws Error (Io, InvalidFile, Unsupported).
std::vector<Camera> readColmapCameras(const CameraFiles& files, const CameraReading& how);

// Reads the cameras from the contents of both text files; `name` names the model in messages. In images.txt the line
// of points behind an image may be missing: for all images, or, with a warning, for some.
std::vector<Camera> parseColmapCameras(std::string_view cameras, std::string_view images, bool binary,
                                       const std::string& name, const CameraReading& how);

} // namespace gsc
