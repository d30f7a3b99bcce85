// SPDX-License-Identifier: Apache-2.0
// Check of --out, the file that a measurement adds rows to.
#pragma once

#include <gsc/file/output_paths.h>

#include <string>
#include <vector>

namespace gsc {

// Checks --out before any work. Throws Error: Usage if it is one of `inputs`, or if two documents would go to standard
// output; Io.
void checkRowOutput(const std::string& out, const std::vector<NamedPath>& inputs, bool json_summary);

} // namespace gsc
