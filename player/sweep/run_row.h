// SPDX-License-Identifier: Apache-2.0
// One run of a sweep as a line of JSON (schemas/run.schema.json) and as a line of a table.
#pragma once

#include "player/measure/runner.h"
#include "player/sweep/sweep_config.h"

#include <nlohmann/json_fwd.hpp>

#include <string>
#include <vector>

namespace gsc {

// What all runs of a command share.
struct RunContext {
    PlayOptions options; // size, field of view and eyes as they were asked for; its trajectory and reuse are not used
    std::string label, reference; // the backend of the exact images
    uint64_t file_bytes = 0, anchors = 0, file_hash = 0;
    uint32_t warmup = 0;
    ScoreOptions score;
};

// The checksum of header and section table, which holds those of everything else. Precondition: Scene::open() took the
// file. Throws Error(Io).
uint64_t fileHash(const std::string& path);

// "config" of the row. Its id tells runs apart: all that changes a result, with the model's content and every pose.
// Precondition: a matched budget is resolved.
nlohmann::ordered_json runConfigJson(const RunContext& context, const Path& path, const RunConfig& run);

nlohmann::ordered_json runRowJson(const RunContext& context, nlohmann::ordered_json config, const RunConfig& run,
                                  const RunResult& result);

// "ms" of a row: times of the frames after the first `warmup`, or of the last one where there are no more.
nlohmann::ordered_json timesJson(const std::vector<RunFrame>& frames, uint32_t warmup);

// "reuse" of a row, over all frames: a cold start is part of what reuse costs.
nlohmann::ordered_json reuseCountsJson(const std::vector<RunFrame>& frames);

std::string runTableHeader();
// Precondition: `row` is of the schema.
std::string runTableLine(const nlohmann::ordered_json& row);

} // namespace gsc
