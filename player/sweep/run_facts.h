// SPDX-License-Identifier: Apache-2.0
// What a run was and what came of it, as its row has it and as a line of a table.
#pragma once

#include "format/checksum.h"
#include "player/measure/runner.h"
#include "player/report/run_row.h"
#include "player/sweep/sweep_config.h"

#include <span>
#include <string>
#include <vector>

namespace gsc {

// Every pose as the backend gets it.
void addPoses(std::span<const Shot> shots, uint32_t eye_count, Checksum64& sum);

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

// Its id tells runs apart: all that changes a result, with the model's content and every pose. Where a matched budget is
// not resolved it is another.
RowConfig rowConfig(const RunContext& context, const Path& path, const RunConfig& run);

// What makes a sweep's shards belong together: `ids` of all its runs, a matched budget not resolved.
uint64_t sweepHash(const RunContext& context, const std::vector<std::string>& ids);

RunRow runRow(const RunContext& context, const RowConfig& config, const RunConfig& run, const RunResult& result);

std::string runTableHeader();
std::string runTableLine(const RunRow& row);

} // namespace gsc
