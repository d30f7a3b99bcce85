// SPDX-License-Identifier: Apache-2.0
#include "convert/commands/checkpoint_options.h"

#include <CLI/CLI.hpp>

#include <map>

namespace gsc {

void addCheckpointOptions(CLI::App& command, CheckpointOptions& options)
{
    static const std::map<std::string, int> kRules = {{"floor", int(LevelRule::Floor)},
                                                      {"round", int(LevelRule::Round)},
                                                      {"ceil", int(LevelRule::Ceil)},
                                                      {"progressive", int(LevelRule::Progressive)}};
    const char* group = "Reading the checkpoint";
    command.add_option("--scene-dir", options.scene_dir, "folder with cameras.json, transforms*.json or cfg_args")
        ->option_text("DIR")
        ->group(group);
    command.add_option("--iteration", options.iteration, "point_cloud/iteration_N to take (default: the largest)")
        ->check(CLI::NonNegativeNumber)
        ->option_text("N")
        ->group(group);
    command.add_option("--dist2level", options.level_rule, "LOD rule of an Octree model that comes without cfg_args")
        ->transform(CLI::CheckedTransformer(kRules))
        ->option_text("floor|round|ceil|progressive")
        ->group(group);
    command.add_option("--add-level", options.add_level, "whether the MLPs take the level, without cfg_args")
        ->check(CLI::Range(0, 1))
        ->option_text("0|1")
        ->group(group);
    command.add_option("--fork", options.fork, "cells per parent cell and axis, without cfg_args (default: 2)")
        ->check(CLI::Range(2, 1024))
        ->option_text("N")
        ->group(group);
}

} // namespace gsc
