// SPDX-License-Identifier: Apache-2.0
// Cameras that a run looks through, and the size of their pictures.
#pragma once

#include "runtime/cameras/camera_reading.h"
#include "runtime/cameras/length.h"

#include <cstdint>
#include <limits>
#include <string>

namespace gsc {

struct CameraChoice {
    std::string file = "stored";    // a camera file or a folder of cameras, or "stored": those in the .gsc
    bool ignore_distortion = false; // draw cameras as if they had no lens distortion; else such a file is refused
    CamerasTransform transform = CamerasTransform::Told;
    int appearance = -1; // the trainer's embedding row, -1 = the camera's
    uint64_t first = 0, end = std::numeric_limits<uint64_t>::max();
    std::string range;          // as typed with its option, "--frames 0:100"
    bool may_end_sooner = true; // `end` is at most that

    [[nodiscard]] bool isFile() const { return file != "stored"; }
    [[nodiscard]] CameraChoice of(const std::string& other) const // the choice for another file
    {
        CameraChoice choice = *this;
        choice.file = other;
        return choice;
    }
};

struct ViewChoice {
    uint32_t width = 0, height = 0; // pixels, 0 = the camera's
    double fov_x = 0;               // radians, 0 = the camera's
    int eyes = 1;
    Length ipd; // distance between two eyes
};

// "2:5" is frames 2, 3 and 4; either end may be left out. False for anything else, and where A is not below B.
bool parseFrameRange(const std::string& text, uint64_t& first, uint64_t& end);

} // namespace gsc
