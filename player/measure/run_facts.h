// SPDX-License-Identifier: Apache-2.0
// Configuration and results of a run as its row.
#pragma once

#include "player/measure/runner.h"
#include "player/options/device_choice.h"
#include "runtime/records/run_row.h"
#include "player/options/run_config.h"

#include <span>
#include <string>
#include <vector>

namespace gsc {

// Options and facts that all runs of a command share.
struct RunContext {
    ViewChoice view;              // as it was asked for
    DeviceChoice devices;         // its limits; a run names its own backend
    int appearance = -1;          // as it was asked for
    std::string label, reference; // the backend of the exact images
    FileFacts file;
    uint64_t file_hash = 0;
    uint32_t warmup = 0;
    uint64_t measured =
        0; // frames, going round the path behind the warm-up; 0 = the path once, its first are the warm-up
    uint32_t in_flight = 1;
    ScoreOptions score;
};

// Key of a run: all by which it differs from others, in the words of schemas/run.schema.json.
OrderedJson runKeyJson(const RunConfig& run);

// Its id tells runs apart: all that changes a result, with the model's content and every pose. Where a matched budget is
// not resolved it is another.
RowConfig rowConfig(const RunContext& context, const Path& path, const RunConfig& run);

// Hash that the shards of one sweep share: of the tool, the label and `ids` of all runs, a matched budget not resolved.
uint64_t sweepHash(const RunContext& context, const std::vector<std::string>& ids);

RunRow runRow(const RunContext& context, const RowConfig& config, const std::string& backend, const RunResult& result);

} // namespace gsc
