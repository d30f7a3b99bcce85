// SPDX-License-Identifier: Apache-2.0
// What a run was and what came of it, as its row has it and as a line of a table.
#pragma once

#include "player/measure/runner.h"
#include "player/report/run_row.h"
#include "player/sweep/sweep_config.h"

#include <string>
#include <vector>

namespace gsc {

// What all runs of a command share.
struct RunContext {
    PlayOptions options; // size, field of view and eyes as they were asked for; its trajectory and reuse are not used
    std::string label, reference; // the backend of the exact images
    FileFacts file;
    uint64_t file_hash = 0;
    uint32_t warmup = 0;
    ScoreOptions score;
};

// The checksum of header and section table, which holds those of everything else. Precondition: Scene::open() took the
// file. Throws Error(Io).
uint64_t fileHash(const std::string& path);

// Its id tells runs apart: all that changes a result, with the model's content and every pose. Precondition: a matched
// budget is resolved.
RowConfig rowConfig(const RunContext& context, const Path& path, const RunConfig& run);

RunRow runRow(const RunContext& context, const RowConfig& config, const RunConfig& run, const RunResult& result);

std::string runTableHeader();
std::string runTableLine(const RunRow& row);

} // namespace gsc
