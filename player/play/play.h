// SPDX-License-Identifier: Apache-2.0
// Playing without a window: draws a list of cameras and writes images and numbers.
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
    Tier tier = Tier::Exact; // tier that was drawn, which may differ from the tier asked for
    FrameChoice frame;       // settings that the frames were drawn with, by choiceOn()
    FileFacts file;
    double open_ms = 0, load_ms = 0;     // time to map and check the file; time to prepare the backend
    std::optional<ServiceStats> service; // numbers of the renderer service, if several devices drew
    std::vector<TimedFrame> frames;      // frames in the order played
    std::vector<std::string> images;     // paths of the written images: frame by frame, left eye first

    // for a shard: number of frames of the whole run, of the shard, and of those done before this start
    uint64_t set_frames = 0, shard_frames = 0, frames_before = 0;
};

// Returns true if something is kept of the frames: files, a report as JSON, or a line for each.
bool isForSomething(const PlayOptions& options, const Reporter& log);

// Plays the cameras of `options`. Throws Error, Usage if it is for nothing; then every image that exists is complete,
// and there is no stats file.
// A shard instead adds a line to its stats file as soon as a frame's images are written; frames that have both are not
// drawn again.
PlaySummary play(const PlayOptions& options, Reporter& log);

} // namespace gsc
