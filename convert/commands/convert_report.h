// SPDX-License-Identifier: Apache-2.0
// Report of `gsc convert` on its work (schemas/convert-report.schema.json).
#pragma once

#include "convert/commands/command.h"
#include "convert/write/write_gsc.h"

#include <string>
#include <vector>

namespace gsc {

struct ConvertFacts {
    const Checkpoint& checkpoint;
    const WriteOptions& options;
    const WriteReport* written = nullptr; // null with --dry-run
    bool verified = false;                // --verify: the file was read back and compared with the checkpoint
    std::vector<std::string> warnings;    // warnings of reading and of writing
    double seconds = 0;
};

Json convertJson(const ConvertFacts& facts);
std::string convertText(const ConvertFacts& facts);

} // namespace gsc
