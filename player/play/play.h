// SPDX-License-Identifier: Apache-2.0
// Headless playing: cameras in, images and numbers out.
#pragma once

#include "player/options/play_options.h"
#include "runtime/cli/reporter.h"
#include "runtime/records/frame_numbers.h"
#include <gsc/frame_stats.h>
#include "runtime/service/service_trace.h"

#include <cstdint>
#include <string>
#include <vector>

namespace gsc {

struct PlaySummary {
    std::string backend;
    Tier tier = Tier::Exact; // tier that ran; may differ from the tier asked for
    FrameChoice frame;       // settings that it was drawn with: choiceOn()
    FileFacts file;
    double open_ms = 0, load_ms = 0;     // mapping and checking the file, preparing the backend
    std::optional<ServiceStats> service; // numbers of the service, if several devices drew
    std::vector<TimedFrame> frames;      // in the order played
    std::vector<std::string> images;     // written files, frame-major, left eye first

    // for a shard: all frames of the set, its own, and those that it had done before
    uint64_t set_frames = 0, shard_frames = 0, frames_before = 0;
};

// Throws Error; every image that exists then is complete, and the stats file is there only if play() returned. A shard's
// gets its line as soon as a frame's images are there, and frames that have both are not drawn again.
PlaySummary play(const PlayOptions& options, Reporter& log);

} // namespace gsc
