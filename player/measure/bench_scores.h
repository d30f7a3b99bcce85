// SPDX-License-Identifier: Apache-2.0
// Some of the cameras that gsc-play bench has measured, scored against the tier exact.
#pragma once

#include "player/measure/bench.h"
#include "player/measure/runner.h"

#include <memory>
#include <vector>

namespace gsc {

// Fills in what the summary says of quality. Where frames depend on those before them, the cameras are played from the first
// on, from a cold start. Timings are not lost where there is no memory for it: that is a warning. Throws Error.
void scoreBench(const BenchOptions& options, const std::shared_ptr<const Scene>& scene, const std::vector<Shot>& shots,
                Renderer& renderer, BenchSummary& summary, Reporter& log);

} // namespace gsc
