// SPDX-License-Identifier: Apache-2.0
// gsc-play bench: what frames cost, measured so that two runs can be compared.
#pragma once

#include "player/measure/scorer.h"
#include "player/options/play_options.h"
#include "runtime/cli/reporter.h"
#include "player/measure/roofline.h"
#include "runtime/records/frame_numbers.h"
#include <gsc/renderer.h>
#include "runtime/service/service_trace.h"
#include "runtime/metrics/metrics.h"

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

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

struct BenchSummary {
    std::string backend;
    Tier tier = Tier::Exact; // that ran (Renderer::tierOf)
    FrameChoice frame;       // as it was drawn: choiceOn()
    double ipd = 0;          // of two eyes
    DeviceFacts device;      // asked for after the last frame, so that clocks are those of the run
    DeviceCeilings ceilings; // measured after the last frame; may be unknown
    AnchorCost anchor_cost;
    FileFacts file;
    double open_ms = 0, load_ms = 0;
    uint64_t shots = 0;      // cameras the frames cycle through
    uint64_t warm_bytes = 0; // most that was resident in the warm-up; 0 = there was none
    // wall_ms: from submit() to its end, or since the end of the frame before; images left on the device. The device's
    // own times are of every try, as that is
    std::vector<TimedFrame> frames;
    std::optional<ServiceStats> service; // of several devices
    std::string reference;               // backend that rendered `exact`
    std::vector<uint64_t> scored;        // cameras, as the paths' frames from 0
    PooledDifference quality;            // over those and their eyes, each eye a frame of it
    std::optional<FoveaAccuracy> fovea;  // of the same; none without foveation
    std::vector<std::string> warnings;
};

// Does it score anything?
inline bool scores(const BenchOptions& options)
{
    return options.quality > 0 || options.scores_path;
}

// Throws Error, before any work where `out` falls on an input or holds something else than rows.
BenchSummary bench(const BenchOptions& options, Reporter& log);

// A table for a person.
std::string benchReportText(const BenchOptions& options, const BenchSummary& summary);
// One object on one line, schemas/bench-report.schema.json.
std::string benchReportJson(const BenchOptions& options, const BenchSummary& summary);

} // namespace gsc
