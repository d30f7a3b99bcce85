// SPDX-License-Identifier: Apache-2.0
// Files that a sample's folder has. Others in it, such as a .gsc, renderings or notes, belong to the user and are kept.
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
