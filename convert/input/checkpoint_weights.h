// SPDX-License-Identifier: Apache-2.0
// The MLPs and the appearance embedding, from any of the three containers the trainers have used.
#pragma once

#include "convert/input/checkpoint.h"
#include "convert/input/checkpoint_files.h"

#include <cstdint>
#include <string>
#include <vector>

namespace gsc {

struct CheckpointWeights {
    std::string container;          // as Checkpoint::container
    std::vector<std::string> paths; // in the order they were read
    std::vector<Mlp> mlps;          // opacity, covariance, colour, [feature bank]; `inputs` not filled in yet
    std::vector<float> embedding;   // rows x columns
    uint32_t embedding_rows = 0, embedding_columns = 0;
    std::vector<std::string> warnings;
};

// Throws Error: InvalidFile (no container, lists what was looked for; damaged or inconsistent), Unsupported (HAC,
// GSDF, tiny-cuda-nn and other networks), Io.
CheckpointWeights readWeights(const CheckpointFiles& files);

} // namespace gsc
