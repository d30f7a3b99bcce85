// SPDX-License-Identifier: Apache-2.0
#include "convert/commands/output_name.h"

#include "format/file/path_ending.h"
#include <gsc/error.h>
#include "runtime/cli/printed_command.h"

#include <algorithm>
#include <initializer_list>

namespace gsc {

namespace {

bool isOneOf(std::initializer_list<const char*> endings, const std::string& ending)
{
    return std::ranges::find(endings, ending) != endings.end();
}

} // namespace

bool isForeignEnding(const std::string& ending)
{
    return isOneOf({".gltf", ".splat", ".ksplat", ".json", ".jsonl"}, ending);
}

void checkGscName(const std::string& output)
{
    const std::string ending = endingOf(output);
    if (isOneOf({".ply", ".spz", ".glb", ".sog", ".html", ".nvdb", ".vdb"}, ending))
        throw Error(ErrorCode::Usage, "--output " + output, "names a " + ending + " file", "FILE.gsc",
                    "write a .gsc first; gsc export FILE.gsc -o " + shellWord(output) + " makes such a file of it");
    if (isForeignEnding(ending))
        throw Error(ErrorCode::Usage, "--output " + output, "names a " + ending + " file", "FILE.gsc",
                    "choose another name");
}

} // namespace gsc
