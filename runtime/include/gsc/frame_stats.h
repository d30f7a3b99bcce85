// SPDX-License-Identifier: Apache-2.0
// Counts and times of a frame, with its settings, as one line of JSON (schemas/frame-stats.schema.json).
#pragma once

#include <gsc/frame_types.h>

#include <string>

namespace gsc {

struct FrameStats {
    uint64_t frame = 0; // index in the camera file
    std::string camera; // name of the camera
    std::string backend;
    Tier tier = Tier::Exact;        // tier that ran (Renderer::tierOf)
    uint32_t width = 0, height = 0; // pixels of one eye
    uint32_t eye_count = 1;
    int appearance = -1; // the trainer's embedding row, -1 = none
    FrameResult result;
    double lod_bias = 0, detail = 0; // FrameOptions' of this frame
};

const char* tierName(Tier tier);

// One object without a line break. Text that is not UTF-8 is replaced, numbers that are not finite become null.
std::string frameStatsJson(const FrameStats& stats);

} // namespace gsc
