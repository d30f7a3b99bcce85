// SPDX-License-Identifier: Apache-2.0
// A trainer's cameras.json, and how large it draws its photographs (format facts, 6: loadCam of utils/camera_utils.py).
#pragma once

#include "runtime/cameras/camera_reading.h"

#include <nlohmann/json_fwd.hpp>

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace gsc {

// Upstream's cameras.json, without appearance and split, of which it says nothing. `name` is used in messages only.
// Throws Error (InvalidFile, Unsupported).
std::vector<SourceCamera> parseUpstreamCameras(std::string_view json, const std::string& name,
                                               const CameraReading& how = {});
// Reads the same from parsed JSON, as upstream draws them.
std::vector<Camera> trainerCameras(const nlohmann::json& root, const std::string& name, const CameraReading& how);

// Returns the camera that upstream renders by default: field of view of the source size, at most 1600 pixels wide
// (6.2). Precondition: `camera` comes from parseUpstreamCameras().
Camera cameraOf(const SourceCamera& source);

// Option -r of the trainers, `resolution` in their settings: 1, 2, 4 and 8 divide, any other is the width in pixels, and
// this one means at most 1600 pixels wide.
constexpr double kDefaultResolution = -1;

struct TrainedSize {
    uint32_t width = 0, height = 0;
};

// Sizes a photograph of `width` x `height`, both rounded as the trainers round them; a side is 1 or more.
TrainedSize trainerSize(uint32_t width, uint32_t height, double resolution);

// Returns `stated`, or, with a warning, the default if no trainer takes such a number; `file` is for the message.
double checkedResolution(double stated, const std::string& file, const CameraReading& how);

// Tells `how` of a cfg_args or config.yaml beside the file `cameras` that may state another resolution than the default,
// or smaller photographs, because that is not applied: settings are parsed by gsc convert alone.
void warnOfSettingsBeside(const std::string& cameras, const CameraReading& how);
// `images` of the settings: images_4 are 1/4 as large, by custom, and then the trainer's pictures are too.
void warnOfSmallImages(const std::string& images, const std::string& file, const CameraReading& how);

} // namespace gsc
