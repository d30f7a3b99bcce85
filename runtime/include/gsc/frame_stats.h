// SPDX-License-Identifier: Apache-2.0
// Counts and times of a frame, with its settings, as one line of JSON (schemas/frame-stats.schema.json).
#pragma once

#include <gsc/frame_types.h>

#include <string>

namespace gsc {

struct FrameStats {
    uint64_t frame = 0; // index of the camera in the camera file
    std::string camera; // name of the camera
    std::string backend;
    Tier tier = Tier::Exact;        // tier that the frame was drawn in (Renderer::tierOf)
    uint32_t width = 0, height = 0; // size of one eye's picture, pixels
    uint32_t eye_count = 1;
    int appearance = -1; // row of the trainer's appearance embedding, -1 = none
    FrameResult result;
    double lod_bias = 0, detail = 0; // FrameOptions' values for this frame
};

const char* tierName(Tier tier);

// Returns one JSON object without a line break. Text that is not UTF-8 is replaced; numbers that are not finite become
// null.
std::string frameStatsJson(const FrameStats& stats);

} // namespace gsc
