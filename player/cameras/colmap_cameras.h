// SPDX-License-Identifier: Apache-2.0
// Cameras of a COLMAP model: a folder with cameras and images as .bin or .txt (colmap.github.io/format.html).
#pragma once

#include "runtime/camera.h"

#include <string>
#include <string_view>
#include <vector>

namespace gsc {

// A folder that has images.bin or images.txt, or one of these files.
bool isColmapModel(const std::string& path);

// By name, at the size of their photographs. `ignored` as for parseCameraFile(). Throws Error (Io, InvalidFile, Unsupported).
std::vector<Camera> readColmapCameras(const std::string& path, std::vector<std::string>* ignored);

// The same from the contents of both files; `name` is used in messages.
std::vector<Camera> parseColmapCameras(std::string_view cameras, std::string_view images, bool binary,
                                       const std::string& name, std::vector<std::string>* ignored);

} // namespace gsc
