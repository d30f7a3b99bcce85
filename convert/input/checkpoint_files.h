// SPDX-License-Identifier: Apache-2.0
// Finds the files that make up the model that the user named.
#pragma once

#include "convert/input/checkpoint.h"

#include <string>
#include <string_view>
#include <vector>

namespace gsc {

struct CheckpointFiles {
    std::string folder; // folder with the PLY and the MLPs
    std::string ply;
    int iteration = -1; // -1 if the folder is not called iteration_<n>
    // Folders in which cfg_args, config.yaml and cameras.json are looked for, in this order.
    std::vector<std::string> side_dirs;
    std::vector<std::string> file_names; // names of the files in `folder`, sorted
    std::vector<std::string> warnings;

    [[nodiscard]] bool has(std::string_view file_name) const; // returns true if `folder` holds the file
    // Path of the file in the first of side_dirs that has it; empty if none has.
    [[nodiscard]] std::string findBeside(const std::string& file_name) const;
};

// Finds the PLY of a model. `path`: a model folder, its point_cloud folder, an iteration folder, any folder with the
// files in it, or the PLY. Throws Error: Io (no such path), InvalidFile (no PLY; the message lists where it was looked
// for), Unsupported (files of a method that we cannot read), Usage (no such --iteration).
CheckpointFiles findCheckpointFiles(const std::string& path, const CheckpointOptions& options);

} // namespace gsc
