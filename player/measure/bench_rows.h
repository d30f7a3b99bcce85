// SPDX-License-Identifier: Apache-2.0
// The file that gsc-play bench adds a row to: --out.
#pragma once

#include <gsc/file/output_paths.h>
#include "player/measure/bench.h"
#include "runtime/records/row_file.h"

#include <string>
#include <vector>

namespace gsc {

// The rows that gsc-play bench adds to --out.
extern const RowKind kBenchRow;
RowFile readBenchRows(const std::string& path);

// --out of gsc-play bench, before any work. Throws Error: Usage (it falls on the model or another of `inputs`, or
// standard output is asked to take two documents), Io.
void checkRowOutput(const BenchOptions& options, std::vector<NamedPath> inputs, bool json_summary);

} // namespace gsc
