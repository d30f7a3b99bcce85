// SPDX-License-Identifier: Apache-2.0
// Rules that tell the trainers' formats apart and fill in the defaults of each trainer's loader.
#pragma once

#include "convert/input/checkpoint.h"
#include "convert/input/checkpoint_files.h"
#include "convert/input/config/config_value.h"
#include "convert/input/ply_reader.h"

#include <string>

namespace gsc {

struct ConfigFile {
    ConfigValue values;   // model parameters; None if no settings file was found
    ConfigValue optim;    // optimisation parameters, of Octree-AnyGS only
    ConfigValue pipeline; // pipeline parameters; None if no settings file was found
    std::string path;     // path of the settings file; empty if none was found

    [[nodiscard]] bool found() const { return !path.empty(); }
    // Path in `values` of the model parameter `key`: Octree-AnyGS keeps these in model_config.kwargs.
    [[nodiscard]] std::string modelKey(const char* key) const;
};

// Finds the kind of model from the names of the PLY's columns. Throws Error(Unsupported) for 3DGS, 2DGS and HAC.
ModelFamily detectFamily(const PlyHeader& header, const std::string& path);

// Reads the MLPs, except what their inputs mean (assignInputs()), and the appearance embedding as it is saved; sets
// `container` and `weight_paths` of the checkpoint. Throws Error: InvalidFile (no weights, the message lists which
// files were looked for; damaged or inconsistent), Unsupported (HAC, GSDF, tiny-cuda-nn and other networks), Io.
void readWeights(const CheckpointFiles& files, Checkpoint& checkpoint);

// Sets Mlp::inputs from the widths of the first layers, and the flags of the feature bank in `checkpoint`; removes an
// appearance embedding that no MLP takes. Throws Error: InvalidFile (a width that fits no set of inputs, or fits two
// and nothing decides), Unsupported.
void assignInputs(Checkpoint& checkpoint, const ConfigFile& config, const CheckpointOptions& options);

// Throws if the trainer's settings make it draw another picture of this PLY and these weights than tier `exact` draws;
// warns of settings that change only some of its pictures. Call after readWeights(). Throws Error(Unsupported).
void refuseOtherPictures(Checkpoint& checkpoint, const ConfigFile& config, bool has_levels);

// Sets level rule, level range, standard distance and voxel size of the checkpoint. Needs `family` and the members that
// openAnchors() needs. Throws Error(InvalidFile).
void readLevels(Checkpoint& checkpoint, const PlyFile& ply, const AnchorColumns& columns, const ConfigFile& config,
                const CheckpointOptions& options);

} // namespace gsc
