// SPDX-License-Identifier: Apache-2.0
// What `gsc convert` tells about its work (schemas/convert-report.schema.json).
#pragma once

#include "convert/bake/bake.h"
#include "convert/commands/command.h"

#include <string>
#include <vector>

namespace gsc {

struct ConvertFacts {
    const Checkpoint& checkpoint;
    const BakeOptions& options;
    const BakeReport* bake = nullptr;  // null with --dry-run
    bool verified = false;             // --verify: the file was read back and compared with the checkpoint
    std::vector<std::string> warnings; // of reading and of baking
    double seconds = 0;
};

Json convertJson(const ConvertFacts& facts);
std::string convertText(const ConvertFacts& facts);

} // namespace gsc
