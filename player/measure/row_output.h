// SPDX-License-Identifier: Apache-2.0
// The file that a measurement adds rows to: --out.
#pragma once

#include <gsc/file/output_paths.h>

#include <string>
#include <vector>

namespace gsc {

// --out, before any work. Throws Error: Usage (it falls on one of `inputs`, or standard output is asked to take two
// documents), Io.
void checkRowOutput(const std::string& out, const std::vector<NamedPath>& inputs, bool json_summary);

} // namespace gsc
