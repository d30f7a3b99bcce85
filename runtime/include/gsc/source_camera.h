// SPDX-License-Identifier: Apache-2.0
// The camera of a photograph, from the trainer's files to a .gsc and back to the screen.
#pragma once

#include <cstdint>
#include <string>

namespace gsc {

// A camera of upstream's cameras.json (format facts, 6.3).
struct SourceCamera {
    std::string name;
    int id = 0;
    uint32_t width = 0, height = 0; // source size, not the trainer's render size
    double position[3] = {};        // camera centre, world units
    double rotation[9] = {};        // row-major camera-to-world; columns are right, down, forward
    double fx = 0, fy = 0;          // pixels, for width x height
    // Pixels from where the axis meets the image to its middle, right and down. Upstream itself knows none but 0, and a
    // .gsc stores none.
    double middle_x = 0, middle_y = 0;
    int appearance = -1; // embedding row; -1 = none or unknown
    bool is_test = false;
};

} // namespace gsc
