// SPDX-License-Identifier: Apache-2.0
// --target-ms for a model.
#pragma once

#include "player/play_options.h"
#include "runtime/lod_control.h"
#include "runtime/scene.h"

#include <optional>

namespace gsc {

// What gives each frame its bias; none without a target. Throws Error(Unsupported) for a model without levels, which
// has no detail to give up.
std::optional<LodControl> lodControl(const Scene& scene, const PlayOptions& options);

} // namespace gsc
