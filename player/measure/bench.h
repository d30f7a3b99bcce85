// SPDX-License-Identifier: Apache-2.0
// gsc-play bench: measures time, memory and counts of frames, in a way that two runs can be compared.
#pragma once

#include "player/options/play_options.h"
#include "runtime/cli/reporter.h"
#include "runtime/records/run_row.h"

#include <cstdint>
#include <string>

namespace gsc {

struct BenchOptions {
    PlayOptions play;                     // model, cameras and rendering; its outputs are not used
    uint32_t warmup = 50, measured = 300; // frames
    double until_steady = 0;              // ends when percentOf() the median's range is at most this; 0 = never sooner
    uint32_t in_flight = 1;   // frames submitted before the first is awaited, at most Renderer::framesInFlight()
    uint32_t quality = 0;     // cameras scored against `exact`, spread over all
    bool scores_path = false; // the frames that `score` chooses are scored instead
    ScoreOptions score;
    std::string reference; // backend that draws the exact images; empty = the measured one
    std::string label;     // free text for the report, such as the change that is measured
    std::string out;       // file that takes a line, empty = none
    std::string sweep;     // file of a sweep to run instead (player/sweep/sweep.h), empty = none
};

// True if pictures are scored.
inline bool scores(const BenchOptions& options)
{
    return options.quality > 0 || options.scores_path;
}

// Measures frames that go round the cameras, after a warm-up; the row has the part "work". Times are from submit() to the
// end of a frame, or since the end of the frame before, if that is later; images stay on the device. The device's own times
// include repeated frames. Throws Error, before any work if `out` is an input or holds anything but rows.
RunRow bench(const BenchOptions& options, Reporter& log);

} // namespace gsc
