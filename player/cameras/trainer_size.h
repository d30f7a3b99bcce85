// SPDX-License-Identifier: Apache-2.0
// How large a trainer draws its photographs (format facts, 6: loadCam of utils/camera_utils.py).
#pragma once

#include "player/cameras/camera_reading.h"

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace gsc {

// What a trainer's settings say of it.
struct TrainerResolution {
    double divisor = -1; // option -r: 1, 2, 4, 8; -1 = at most 1600 wide; any other is the width in pixels
    double scale = 1;    // resolution_scale, a divisor too

    // As where no settings are found: Camera's own rule then says the same.
    [[nodiscard]] bool isDefault() const { return divisor == -1 && scale == 1; }
};

struct ImageSize {
    uint32_t width = 0, height = 0;
};

// Of a photograph of `width` x `height`, both rounded as the trainers round them; a side is 1 or more.
ImageSize trainerSize(uint32_t width, uint32_t height, const TrainerResolution& resolution);

// `stated`, or the default where no trainer takes such numbers, which `how` is told of; `file` is for the message.
TrainerResolution checkedResolution(const TrainerResolution& stated, const std::string& file, const CameraReading& how);

// What cfg_args in `folder` says, or else config.yaml; nothing where neither is there or states a resolution.
// `how` is told of photographs in a folder that is called as smaller copies are. Throws Error(Io).
std::optional<TrainerResolution> readTrainerResolution(const std::string& folder, const CameraReading& how);
// The same of the text of a cfg_args, which is Python's Namespace(...).
std::optional<TrainerResolution> trainerResolutionOf(std::string_view cfg_args, const std::string& file,
                                                     const CameraReading& how);
// `images` of the settings: images_4 are 1/4 as large, by custom, and then the trainer's pictures are too.
void warnOfSmallImages(const std::string& images, const std::string& file, const CameraReading& how);

} // namespace gsc
