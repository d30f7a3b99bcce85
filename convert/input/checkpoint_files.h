// SPDX-License-Identifier: Apache-2.0
// Files that make up the model that a user named.
#pragma once

#include "convert/input/checkpoint.h"

#include <string>
#include <string_view>
#include <vector>

namespace gsc {

struct CheckpointFiles {
    std::string folder; // folder of the PLY and the weights
    std::string ply;
    int iteration = -1; // -1: the folder is not called iteration_<n>
    // folders that cfg_args, config.yaml and cameras.json are looked for in, in this order
    std::vector<std::string> side_dirs;
    std::vector<std::string> file_names; // names of the files in `folder`, sorted
    std::vector<std::string> warnings;

    [[nodiscard]] bool has(std::string_view file_name) const; // true if `folder` has the file
    // The first of the side folders that holds it, joined; empty if none does.
    [[nodiscard]] std::string findBeside(const std::string& file_name) const;
};

// Finds the PLY below or at `path`: a model folder, its point_cloud folder, an iteration folder, a folder with the
// files in it, or the PLY. Throws Error: Io (no such path), InvalidFile (no PLY; lists what was looked for),
// Unsupported (the files of another method), Usage (--iteration that is not there).
CheckpointFiles findCheckpointFiles(const std::string& path, const CheckpointOptions& options);

} // namespace gsc
