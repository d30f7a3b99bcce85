// SPDX-License-Identifier: Apache-2.0
// Options of every command that reads a checkpoint.
#pragma once

#include "convert/input/checkpoint.h"

namespace CLI {
class App;
} // namespace CLI

namespace gsc {

void addCheckpointOptions(CLI::App& command, CheckpointOptions& options);

} // namespace gsc
