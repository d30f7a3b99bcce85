// SPDX-License-Identifier: Apache-2.0
// What a model is, told the same way from a checkpoint and from a .gsc file.
#pragma once

#include "convert/commands/command.h"
#include "format/gsc_layout.h"

#include <string>

namespace gsc {

struct Checkpoint;

const char* familyName(uint32_t family);     // ModelFamily: "scaffold-gs", ...
const char* levelRuleName(uint32_t rule);    // LevelRule: "none", "floor", ...
const char* rasterRulesName(uint32_t rules); // RasterRules: "diff-gaussian", "gsplat"

// The hyper-parameters a checkpoint has in common with the file made from it.
ModelParams paramsOf(const Checkpoint& checkpoint);

// The "model" object of every report (schemas/model.schema.json) and its text, a few lines without the last newline.
Json modelJson(const ModelParams& params, uint64_t anchors);
std::string modelText(const ModelParams& params, uint64_t anchors);

} // namespace gsc
