// SPDX-License-Identifier: Apache-2.0
// Checkpoints in upstream's own layout: made from nothing, or a real model tiled into a city.
#pragma once

#include "convert/sample/model/sample_kinds.h"

#include <cstdint>
#include <functional>
#include <string>

namespace gsc {

struct SampleOptions {
    SampleScene scene = SampleScene::City;
    SampleModel model = SampleModel::Scaffold;
    uint64_t anchors = 100'000; // reached exactly
    uint64_t seed = 1;
    bool everything_on = false; // feature bank, appearance, distances and level: every input upstream knows
    std::string output;         // model folder to create
    bool overwrite = false;
};

struct ReplicateOptions {
    std::string input; // a real aerial model
    uint64_t anchors = 1'300'000;
    uint64_t seed = 1;
    std::string output;
    bool overwrite = false;
};

struct SampleReport {
    uint64_t anchors = 0;
    uint64_t tiles = 0; // replicate only
    uint64_t ply_bytes = 0;
    double seconds = 0;
    std::string path_file; // paths/aerial.json in the output folder; the other trajectories lie beside it
};

using SampleProgress = std::function<void(const char* stage, uint64_t done, uint64_t total)>;

// Same options, same bytes. Memory does not grow with the number of anchors. Throws Error (Usage, Io, Interrupted);
// then nothing is left behind.
SampleReport makeSample(const SampleOptions& options, const SampleProgress& progress);
SampleReport replicateCheckpoint(const ReplicateOptions& options, const SampleProgress& progress);

} // namespace gsc
