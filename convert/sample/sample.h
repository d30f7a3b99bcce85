// SPDX-License-Identifier: Apache-2.0
// Makes checkpoints in the trainers' own layout: of an invented scene, or of a real model repeated into a city.
#pragma once

#include "convert/sample/model/sample_kinds.h"

#include <cstdint>
#include <functional>
#include <string>

namespace gsc {

struct SampleOptions {
    SampleScene scene = SampleScene::City;
    SampleModel model = SampleModel::Scaffold;
    uint64_t anchors = 100'000; // exact number of anchors
    uint64_t seed = 1;
    // with feature bank, appearance, distances and level, which are all the inputs that the trainers know
    bool everything_on = false;
    std::string output; // path of the model folder to create
    bool overwrite = false;
};

struct ReplicateOptions {
    std::string input; // path of a real aerial model
    uint64_t anchors = 1'300'000;
    uint64_t seed = 1;
    std::string output;
    bool overwrite = false;
};

struct SampleReport {
    uint64_t anchors = 0;
    uint64_t tiles = 0; // only of replicateCheckpoint()
    uint64_t ply_bytes = 0;
    double seconds = 0;
    std::string path_file; // path of paths/aerial.json in the output folder; the other trajectories lie beside it
};

using SampleProgress = std::function<void(const char* stage, uint64_t done, uint64_t total)>;

// Makes a sample. Equal options give equal bytes. Memory does not grow with the number of anchors. Throws Error (Usage,
// Io, Interrupted); then nothing is left in the output folder.
SampleReport makeSample(const SampleOptions& options, const SampleProgress& progress);
SampleReport replicateCheckpoint(const ReplicateOptions& options, const SampleProgress& progress);

} // namespace gsc
