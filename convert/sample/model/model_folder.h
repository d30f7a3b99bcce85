// SPDX-License-Identifier: Apache-2.0
// Folder of a sample or a city. Other files in it, such as a .gsc, renderings or notes, belong to the user.
#pragma once

#include "format/file/new_folder.h"

namespace gsc {

constexpr FolderKind kModelFolder = {
    "model folder", "gsc sample", {"cfg_args", "point_cloud"}, [](const std::filesystem::path& entry) {
        const std::string name = entry.filename().string();
        return name == "cameras.json" || name == "cfg_args" || name == "metre.json" || name == "paths" ||
               name == "point_cloud";
    }};

} // namespace gsc
