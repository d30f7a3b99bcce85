// SPDX-License-Identifier: Apache-2.0
#include "convert/commands/output_name.h"

#include <gsc/error.h>

#include <algorithm>
#include <filesystem>

namespace gsc {

std::string endingOf(const std::string& path)
{
    std::string ending = std::filesystem::path(path).extension().string();
    std::ranges::transform(ending, ending.begin(), [](char c) { return c >= 'A' && c <= 'Z' ? char(c + 32) : c; });
    return ending;
}

void checkGscName(const std::string& output)
{
    const std::string ending = endingOf(output);
    const auto named = [&](std::initializer_list<const char*> others) {
        return std::ranges::find(others, ending) != others.end();
    };
    if (named({".ply", ".spz", ".glb", ".sog", ".html", ".nvdb", ".vdb"}))
        throw Error(ErrorCode::Usage, "--output " + output, "names a " + ending + " file", "FILE.gsc",
                    "write a .gsc first; gsc export FILE.gsc -o " + output + " makes such a file of it");
    if (named({".gltf", ".splat", ".ksplat", ".json", ".jsonl"}))
        throw Error(ErrorCode::Usage, "--output " + output, "names a " + ending + " file", "FILE.gsc",
                    "choose another name");
}

} // namespace gsc
