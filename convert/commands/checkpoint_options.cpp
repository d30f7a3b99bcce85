// SPDX-License-Identifier: Apache-2.0
#include "convert/commands/checkpoint_options.h"

#include "runtime/cli/options.h"

#include <limits>

namespace gsc {

void addCheckpointOptions(CLI::App& command, CheckpointOptions& options)
{
    const Heading heading(command, "Checkpoint to read");
    addText(command, "--scene-dir", options.scene_dir, "DIR",
            "folder with cameras.json, transforms*.json or cfg_args, if not the model's");
    addInteger(command, "--iteration", options.iteration, 0, std::numeric_limits<int>::max(),
               "N (default: the largest)", "training iteration to read: folder point_cloud/iteration_N")
        .rare();
    addChoice<int>(command, "--dist2level", options.level_rule,
                   {{"floor", int(LevelRule::Floor)},
                    {"round", int(LevelRule::Round)},
                    {"ceil", int(LevelRule::Ceil)},
                    {"progressive", int(LevelRule::Progressive)}},
                   "", "rounding from distance to level, for an Octree model without cfg_args")
        .rare();
    addInteger(command, "--add-level", options.add_level, 0, 1, "0|1",
               "1 if the networks take the level as an input, for a model without cfg_args")
        .rare();
    addInteger(command, "--fork", options.fork, 2, 1024, "N (default: 2)",
               "cells along each axis of a cell of the next coarser level, for a model without cfg_args")
        .rare();
}

} // namespace gsc
