// SPDX-License-Identifier: Apache-2.0
// Log of the window: a JSON line for each frame that it showed (schemas/window-log.schema.json).
#pragma once

#include "runtime/cli/json.h"

#include <cstdint>
#include <string>
#include <vector>

namespace gsc {

struct WindowFrame {
    uint64_t frame = 0;            // number of the frame, from 1
    double seconds = 0;            // seconds since the window opened
    uint64_t pose = 0;             // number of the pose whose picture is shown; 0 = none yet
    uint64_t asked = 0;            // number of the pose submitted last
    std::vector<std::string> keys; // names of the keys pressed since the last frame
    uint32_t width = 0, height = 0;
    // time since the last frame; time from submitting the pose until its picture was finished
    double refresh_ms = 0, latency_ms = 0;
    uint64_t anchors_absent = 0; // anchors of the model that were not yet on the device when the picture was drawn
    double lod_bias = 0, detail = 0, fovea_pixels = 0; // settings that the picture was drawn with
    double position[3] = {};                           // position of the camera, world units
    double speed = 0;                                  // speed of the movement, world units per second
    std::string shows;                                 // kind of view that is shown: "picture", "split" or "difference"
    // difference of the picture from the exact one: PSNR in dB, and FLIP; flip below 0 = not known
    double psnr = 0, flip = -1;
    std::string wrote; // path of a file written for this frame, empty = none
    std::string said;  // message shown at the bottom, empty = none
};

OrderedJson windowLine(const WindowFrame& frame);

} // namespace gsc
