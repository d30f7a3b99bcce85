// SPDX-License-Identifier: Apache-2.0
// Where the real trained models are, if they are.
#pragma once

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

namespace gsc::test {

// Folder of the trained models, or empty: GSC_CHECKPOINTS, else ../shared/checkpoints beside the repository.
inline std::string checkpointsRoot()
{
    if (const char* path = std::getenv("GSC_CHECKPOINTS"))
        return std::filesystem::is_directory(path) ? path : "";
    const std::filesystem::path root = std::filesystem::path(GSC_SOURCE_DIR) / "../shared/checkpoints";
    return std::filesystem::is_directory(root) ? std::filesystem::canonical(root).string() : "";
}

// The trained models, sorted by name; prints why the test is skipped where there are none.
inline std::vector<std::string> trainedModels()
{
    std::vector<std::string> models;
    const std::string root = checkpointsRoot();
    if (root.empty()) {
        std::printf("skipped: no trained models; set GSC_CHECKPOINTS to their folder\n");
        return models;
    }
    for (const char* name :
         {"boruszyn_octree", "boruszyn_scaffold", "fox_octree", "fox_octree_all", "fox_scaffold", "fox_scaffold_all"})
        if (std::filesystem::is_directory(root + "/" + name))
            models.push_back(root + "/" + name);
    return models;
}

} // namespace gsc::test
