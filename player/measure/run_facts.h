// SPDX-License-Identifier: Apache-2.0
// A row made from the settings and results of a run.
#pragma once

#include "player/measure/runner.h"
#include "player/options/device_choice.h"
#include "runtime/records/run_row.h"
#include "player/options/run_config.h"

#include <span>
#include <string>
#include <vector>

namespace gsc {

// Options and facts shared by all runs of a command.
struct RunContext {
    ViewChoice view;              // eyes and size on the command line
    DeviceChoice devices;         // limits of memory and threads; a run names its own backend
    int appearance = -1;          // number on the command line
    std::string label, reference; // the backend of the exact images
    FileFacts file;
    uint64_t file_hash = 0;
    uint32_t warmup = 0;
    uint64_t measured =
        0; // frames, round the path after the warm-up; 0 = the path once, whose first frames are the warm-up
    double until_steady = 0; // BenchOptions::until_steady; `measured` is then the most frames
    uint32_t in_flight = 1;
    ScoreOptions score;
};

// Key of a run: the settings in which the runs of a sweep differ, in the words of schemas/run.schema.json.
OrderedJson runKeyJson(const RunConfig& run);

// Settings of a run. Their id is a hash of everything that changes a result, with the model's content and every pose. A
// decode budget of "match" changes the id when its number is known.
RowConfig rowConfig(const RunContext& context, const Path& path, const RunConfig& run);

// Hash that the shards of one sweep share: tool, label and `ids` of all runs, before a budget of "match" has its number.
uint64_t sweepHash(const RunContext& context, const std::vector<std::string>& ids);

// Row of a run.
RunRow runRow(const RunContext& context, const RowConfig& config, const std::string& backend, const RunResult& result);

} // namespace gsc
