// SPDX-License-Identifier: Apache-2.0
// Some of the cameras that gsc-play bench has measured, scored against the tier exact.
#pragma once

#include "player/measure/bench.h"
#include "player/measure/run_facts.h"

#include <memory>

namespace gsc {

// Tells `context` which frames it scores against which backend. Where frames depend on those before them, the cameras are
// played from the first on, from a cold start. Where there is no memory for it, that is a warning and there are no images.
// Throws Error.
Accuracy scoreBench(const BenchOptions& options, const std::shared_ptr<const Scene>& scene, const Path& path,
                    const FrameChoice& choice, Renderer& renderer, RunContext& context, Reporter& log);

} // namespace gsc
