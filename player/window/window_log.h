// SPDX-License-Identifier: Apache-2.0
// Log of the window: a JSON line for every frame that it showed (schemas/window-log.schema.json).
#pragma once

#include "runtime/cli/json.h"

#include <cstdint>
#include <string>
#include <vector>

namespace gsc {

struct WindowFrame {
    uint64_t frame = 0;            // shown by the window, from 1
    double seconds = 0;            // since it opened
    uint64_t pose = 0;             // pose whose picture is shown; 0 = none yet
    uint64_t asked = 0;            // newest pose that was submitted
    std::vector<std::string> keys; // keys pressed since the frame before
    uint32_t width = 0, height = 0;
    double refresh_ms = 0, latency_ms = 0; // from frame to frame; from the pose to its picture
    uint64_t anchors_absent = 0;           // anchors of the model not yet on the device, when the picture was drawn
    double lod_bias = 0, detail = 0, fovea_pixels = 0; // settings of the picture
    double position[3] = {};                           // position of the viewer
    std::string shows;                                 // "picture", "split" or "difference"
    double psnr = 0, flip = -1;                        // difference of the last two pictures; flip below 0 = not known
    std::string wrote;                                 // file that was written for this frame, empty = none
    std::string said;                                  // the message at the bottom, empty = none
};

OrderedJson windowLine(const WindowFrame& frame);

} // namespace gsc
