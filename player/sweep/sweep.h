// SPDX-License-Identifier: Apache-2.0
// gsc-play bench --sweep: the same poses with every combination asked for, a row for each run.
#pragma once

#include "player/measure/bench.h"
#include "runtime/records/run_row.h"

#include <functional>

namespace gsc {

// Appends a row (schemas/run.schema.json) to options.out, if any, as soon as a run is done; a run whose row is there
// already is not done again. `show` gets every row in order, those too. Throws Error.
void sweep(const BenchOptions& options, Reporter& log, const std::function<void(const RunRow&)>& show);

} // namespace gsc
