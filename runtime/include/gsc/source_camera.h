// SPDX-License-Identifier: Apache-2.0
// The camera of a photograph as the trainer's files state it and a .gsc file stores it.
#pragma once

#include <cstdint>
#include <string>

namespace gsc {

// A camera of the trainers' cameras.json (format facts, 6.3).
struct SourceCamera {
    std::string name;
    int id = 0;
    uint32_t width = 0, height = 0; // size of the photograph in pixels, not that of the trainer's pictures
    double position[3] = {};        // camera's centre, world units
    double rotation[9] = {};        // row-major camera-to-world; columns are right, down, forward
    double fx = 0, fy = 0;          // focal lengths in pixels, for a picture of width x height
    // Distance from where the lens's axis meets the image to the image's middle, in pixels right and down. Always 0
    // for the trainers' cameras; a .gsc file does not store it.
    double middle_x = 0, middle_y = 0;
    int appearance = -1; // row of the appearance embedding; -1 = none or unknown
    bool is_test = false;
};

} // namespace gsc
