// SPDX-License-Identifier: Apache-2.0
#include "convert/commands/checkpoint_options.h"

#include "runtime/cli/options.h"

#include <limits>

namespace gsc {

void addCheckpointOptions(CLI::App& command, CheckpointOptions& options)
{
    const Heading heading(command, "Checkpoint to read");
    addText(command, "--scene-dir", options.scene_dir, "DIR", "folder with cameras.json, transforms*.json or cfg_args");
    addInteger(command, "--iteration", options.iteration, 0, std::numeric_limits<int>::max(),
               "N (default: the largest)", "point_cloud/iteration_N to take")
        .rare();
    addChoice<int>(command, "--dist2level", options.level_rule,
                   {{"floor", int(LevelRule::Floor)},
                    {"round", int(LevelRule::Round)},
                    {"ceil", int(LevelRule::Ceil)},
                    {"progressive", int(LevelRule::Progressive)}},
                   "", "LOD rule of an Octree model without cfg_args")
        .rare();
    addInteger(command, "--add-level", options.add_level, 0, 1, "0|1",
               "1 if the MLPs take the level, of a model without cfg_args")
        .rare();
    addInteger(command, "--fork", options.fork, 2, 1024, "N (default: 2)",
               "cells per parent cell and axis, of a model without cfg_args")
        .rare();
}

} // namespace gsc
