// SPDX-License-Identifier: Apache-2.0
// Headless playing: cameras in, images and numbers out.
#pragma once

#include "player/play_options.h"
#include "player/tool/reporter.h"
#include "player/report/report_parts.h"
#include "runtime/frame_stats.h"

#include <cstdint>
#include <string>
#include <vector>

namespace gsc {

struct PlaySummary {
    std::string input, backend;
    Tier tier = Tier::Exact; // that ran, not that was asked for
    int eyes = 1;
    StereoMode stereo = StereoMode::Exact;
    ReuseOptions reuse;
    LodFacts lod;
    uint64_t anchors = 0, file_bytes = 0;
    double open_ms = 0, load_ms = 0; // mapping and checking the file, preparing the backend
    std::vector<FrameResult> frames; // in the order played
    std::vector<double> pixels;      // of one eye, per frame
    std::vector<std::string> images; // written files, frame-major, left eye first
};

// Throws Error; every image that exists then is complete, and the stats file is there only if play() returned.
PlaySummary play(const PlayOptions& options, Reporter& log);

} // namespace gsc
