// SPDX-License-Identifier: Apache-2.0
// Reports of `gsc convert` (schemas/convert-report.schema.json).
#pragma once

#include "convert/commands/command.h"
#include "convert/write/write_gsc.h"

#include <string>
#include <vector>

namespace gsc {

struct ConvertFacts {
    const Checkpoint& checkpoint;
    const WriteOptions& options;
    const WriteReport* written = nullptr; // result of the writer; null with --dry-run
    bool verified = false;                // true if --verify read the file back and found every value equal
    std::vector<std::string> warnings;    // warnings from reading the checkpoint and from writing the file
    double seconds = 0;
};

Json convertJson(const ConvertFacts& facts);
std::string convertText(const ConvertFacts& facts);

} // namespace gsc
