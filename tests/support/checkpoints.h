// SPDX-License-Identifier: Apache-2.0
// Where the real trained models are, if they are.
#pragma once

#include "tests/support/skipped.h"
#include "tests/support/source_folder.h"

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <vector>

namespace gsc::test {

// Folder of the trained models, or empty: GSC_CHECKPOINTS, else ../shared/checkpoints beside the repository.
inline std::string checkpointsRoot()
{
    if (const char* path = std::getenv("GSC_CHECKPOINTS")) {
        if (!std::filesystem::is_directory(path))
            throw std::runtime_error(std::string("GSC_CHECKPOINTS is \"") + path +
                                     "\", expected a folder; unset it or "
                                     "correct it");
        return path;
    }
    const std::filesystem::path root = std::filesystem::path(sourceFolder()) / "../shared/checkpoints";
    return std::filesystem::is_directory(root) ? std::filesystem::canonical(root).string() : "";
}

// The trained models, sorted by name; prints those that are missing. Where there are none the test says so at its end,
// which CTest shows as skipped.
inline std::vector<std::string> trainedModels()
{
    std::vector<std::string> models;
    const std::string root = checkpointsRoot();
    for (const char* name :
         {"boruszyn_octree", "boruszyn_scaffold", "fox_octree", "fox_octree_all", "fox_scaffold", "fox_scaffold_all"})
        if (!root.empty() && std::filesystem::is_directory(root + "/" + name))
            models.push_back(root + "/" + name);
        else if (!root.empty())
            std::printf("note: %s/%s is missing and not tested\n", root.c_str(), name);
    g_without_models = g_without_models || models.empty();
    return models;
}

} // namespace gsc::test
