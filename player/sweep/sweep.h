// SPDX-License-Identifier: Apache-2.0
// gsc-play bench --sweep: draws all trajectories with every combination of settings, a row for each run.
#pragma once

#include "player/measure/bench.h"
#include "runtime/records/run_row.h"

#include <functional>

namespace gsc {

// Does the runs. Adds a row (schemas/run.schema.json) to options.out, if any, as soon as a run is done; a run with a row in
// that file is not done again. `show` is called with every row in order, old ones too. Throws Error.
void sweep(const BenchOptions& options, Reporter& log, const std::function<void(const RunRow&)>& show);

} // namespace gsc
