// SPDX-License-Identifier: Apache-2.0
// Reads a trainer's cameras.json, and computes the size in which the trainer draws its photographs (format facts, 6:
// loadCam of utils/camera_utils.py).
#pragma once

#include "runtime/cameras/camera_reading.h"

#include <nlohmann/json_fwd.hpp>

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace gsc {

// Parses the trainers' cameras.json, which does not state appearance and split. `name` names the file in messages.
// Throws Error (InvalidFile, Unsupported).
std::vector<SourceCamera> parseUpstreamCameras(std::string_view json, const std::string& name,
                                               const CameraReading& how = {});
// Reads the cameras from parsed JSON, in the sizes in which the trainers draw them.
std::vector<Camera> trainerCameras(const nlohmann::json& root, const std::string& name, const CameraReading& how);

// Returns the camera that the trainers render by default: with the field of view of the source size, at most 1600
// pixels wide (format facts, 6.2). Precondition: `source` comes from parseUpstreamCameras().
Camera cameraOf(const SourceCamera& source);

// Default of the trainers' option -r (`resolution` in their settings): -1 means at most 1600 pixels wide. The values
// 1, 2, 4 and 8 divide the size instead, and any other number is the width in pixels.
constexpr double kDefaultResolution = -1;

struct TrainedSize {
    uint32_t width = 0, height = 0;
};

// Computes the size in which a photograph of `width` x `height` pixels is drawn, rounded as by the trainers; at least
// 1 x 1.
TrainedSize trainerSize(uint32_t width, uint32_t height, double resolution);

// Returns `stated` if a trainer takes such a number, else the default, with a warning that names `file`.
double checkedResolution(double stated, const std::string& file, const CameraReading& how);

// Warns in `how` if a cfg_args or config.yaml beside the file `cameras` may state smaller photographs or another
// resolution than the default. These are not applied: only gsc convert parses settings.
void warnOfSettingsBeside(const std::string& cameras, const CameraReading& how);
// Warns if `images`, a value in the trainer's settings, names smaller photographs: by custom, images_4 holds
// photographs of a quarter of the size, and then the trainer's pictures are as small.
void warnOfSmallImages(const std::string& images, const std::string& file, const CameraReading& how);

} // namespace gsc
