// SPDX-License-Identifier: Apache-2.0
// Rules that tell the trainers apart, and fill in the defaults of each trainer's loader.
#pragma once

#include "convert/input/checkpoint.h"
#include "convert/input/checkpoint_files.h"
#include "convert/input/config/config_value.h"
#include "convert/input/ply_reader.h"

#include <string>

namespace gsc {

struct ConfigFile {
    ConfigValue values;   // the model parameters; None if no file was found
    ConfigValue optim;    // Octree-AnyGS only: optimisation parameters
    ConfigValue pipeline; // the pipeline parameters; None if no file was found
    std::string path;     // empty if no file was found

    [[nodiscard]] bool found() const { return !path.empty(); }
    // `key` of the model: Octree-AnyGS nests the model's own arguments in model_config.kwargs.
    [[nodiscard]] std::string modelKey(const char* key) const;
};

// From the columns alone (format facts, 1.3). Throws Error(Unsupported) for 3DGS, 2DGS and HAC.
ModelFamily detectFamily(const PlyHeader& header, const std::string& path);

// Sets `container`, `weight_paths`, `mlps` but for their inputs, and embedding and `appearance_dim` as they are saved.
// Throws Error: InvalidFile (no container, lists what was looked for; damaged or inconsistent), Unsupported (HAC,
// GSDF, tiny-cuda-nn and other networks), Io.
void readWeights(const CheckpointFiles& files, Checkpoint& checkpoint);

// Sets Mlp::inputs from the widths of the first layers, and the bank's share of `checkpoint`; drops an embedding that no
// MLP takes. Throws Error: InvalidFile (widths that fit no input, or fit two where nothing decides), Unsupported.
void assignInputs(Checkpoint& checkpoint, const ConfigFile& config, const CheckpointOptions& options);

// Refuses settings with which the trainer draws another picture of the same PLY and weights than tier `exact`; warns
// of those with which it draws others too. The weights are there. Throws Error(Unsupported).
void refuseOtherPictures(Checkpoint& checkpoint, const ConfigFile& config, bool has_levels);

// Level rule, level range, standard distance and voxel size. `family` and what openAnchors() needs of `checkpoint`
// are there. Throws Error(InvalidFile).
void readLevels(Checkpoint& checkpoint, const PlyFile& ply, const AnchorColumns& columns, const ConfigFile& config,
                const CheckpointOptions& options);

} // namespace gsc
