// SPDX-License-Identifier: Apache-2.0
// Reads the cameras that a model was trained and tested with.
#pragma once

#include "convert/input/checkpoint_files.h"
#include "convert/input/config/config_value.h"

#include <cstdint>
#include <string>
#include <vector>

namespace gsc {

// Reads cameras.json, or transforms*.json if there is none. Finds for each camera its row of the appearance embedding,
// and whether it was left out of training. Lens distortion and principal points are left out with a warning. `config`:
// the trainer's settings, may be null. Throws Error (Io, InvalidFile).
std::vector<SourceCamera> readCameras(const CheckpointFiles& files, const ConfigValue* config,
                                      const std::string& config_path, uint32_t embedding_rows,
                                      std::vector<std::string>& warnings);

// Marks the test cameras and sets the embedding row of each camera. Test cameras come first in the list, and ids must
// be positions in it. `eval`: the trainer's option, -1 if no settings state it. `lod`: Scaffold-GS's option that splits
// BungeeNeRF data sets; 0 = every eighth image is a test image.
void assignSplit(std::vector<SourceCamera>& cameras, uint32_t embedding_rows, int eval, int lod,
                 std::vector<std::string>& warnings);

} // namespace gsc
