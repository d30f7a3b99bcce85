// SPDX-License-Identifier: Apache-2.0
// Check of --out, the file that a measurement adds rows to.
#pragma once

#include <gsc/file/output_paths.h>

#include "runtime/records/run_row.h"

#include <string>
#include <vector>

namespace gsc {

// Checks --out before any work. Throws Error: Usage if it is one of `inputs`, or if two documents would go to standard
// output; Io.
void checkRowOutput(const std::string& out, const std::vector<NamedPath>& inputs, bool json_summary);

// Throws Error(Usage): a file that holds rows of a shard, of gsc-play stability or of gsc bake --curve takes no others, since
// whoever reads it next would refuse it. `where`: place of the row, for the message.
[[noreturn]] void refuseMixed(const std::string& where, const RunRow& row);

} // namespace gsc
