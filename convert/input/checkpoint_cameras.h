// SPDX-License-Identifier: Apache-2.0
// The cameras a model was trained and tested with.
#pragma once

#include "convert/input/checkpoint_files.h"
#include "convert/input/config/config_value.h"

#include <cstdint>
#include <string>
#include <vector>

namespace gsc {

// Reads cameras.json, or transforms*.json where there is none, and finds the embedding row of each camera, and whether
// it was held out of training. Distortion and principal points are left out with a warning. `config` may be null.
// Throws Error (Io, InvalidFile).
std::vector<SourceCamera> readCameras(const CheckpointFiles& files, const ConfigValue* config,
                                      const std::string& config_path, uint32_t embedding_rows,
                                      std::vector<std::string>& warnings);

// The rule by itself: test cameras come first, ids are positions in the list. `eval` is -1 where cfg_args does not
// say; `lod` is Scaffold-GS's split rule for BungeeNeRF, 0 for every 8th image.
void assignSplit(std::vector<SourceCamera>& cameras, uint32_t embedding_rows, int eval, int lod,
                 std::vector<std::string>& warnings);

} // namespace gsc
