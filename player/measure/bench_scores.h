// SPDX-License-Identifier: Apache-2.0
// Some of the cameras that gsc-play bench has measured, scored against the tier exact.
#pragma once

#include "player/measure/bench.h"
#include "player/measure/run_facts.h"

#include <memory>

namespace gsc {

// Steps of scoreBench(); `in_order`: the path is played up to the last scored frame.
uint64_t scoreSteps(const BenchOptions& options, uint64_t cameras, bool in_order);

// Scores frames and writes to `context` which frames, and the backend of the exact images. If frames depend on earlier
// frames, the cameras are played from the first on, from a cold start. Without memory for the pictures it warns and the
// result has no images. Throws Error.
Accuracy scoreBench(const BenchOptions& options, const std::shared_ptr<const Scene>& scene, const Path& path,
                    const FrameChoice& choice, Renderer& renderer, RunContext& context, Reporter& log,
                    const StepDone& done);

} // namespace gsc
