// SPDX-License-Identifier: Apache-2.0
// gsc-play bench: what frames cost, measured so that two runs can be compared.
#pragma once

#include "player/options/play_options.h"
#include "runtime/cli/reporter.h"
#include "runtime/records/run_row.h"

#include <cstdint>
#include <string>

namespace gsc {

struct BenchOptions {
    PlayOptions play;                     // what and how to render; its outputs are not used
    uint32_t warmup = 50, measured = 300; // frames
    uint32_t in_flight = 1;               // frames, at most Renderer::framesInFlight()
    uint32_t quality = 0;                 // cameras scored against `exact`, spread over all
    bool scores_path = false;             // those that `score` says, instead
    ScoreOptions score;
    std::string reference; // backend that renders `exact` for it; empty = the measured one
    std::string label;     // free text for the report, such as what changed
    std::string out;       // file that takes a line, empty = none
    std::string sweep;     // file that says what to run instead (player/sweep/sweep.h), empty = none
};

// Does it score anything?
inline bool scores(const BenchOptions& options)
{
    return options.quality > 0 || options.scores_path;
}

// Frames go round the cameras behind the warm-up; the row has the part "work". Times are from submit() to the end of a
// frame, or since the end of the frame before, images left on the device; the device's own times are of every try. Throws
// Error, before any work where `out` falls on an input or holds something else than rows.
RunRow bench(const BenchOptions& options, Reporter& log);

} // namespace gsc
