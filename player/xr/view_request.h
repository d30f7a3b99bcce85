// SPDX-License-Identifier: Apache-2.0
// A headset's pose becomes a request for pictures: a camera for each eye, in pairs.
#pragma once

#include "player/poses/placement.h"
#include "player/present/headset/headset.h"
#include "player/xr/late_eyes.h"
#include "player/xr/view_lenses.h"
#include "player/xr/view_source.h"

#include <memory>

namespace gsc {

// Fills `views`, whose `eyes` are set, for a space that lies at `place`. `lens`: name, planes and appearance of the cameras;
// size and format are the headset's. `gaze` may be null, and so may `late`, which finds the eyes again when they are drawn.
void requestViews(AskedViews& views, const Shot& lens, const Placement& place, const HeadsetFacts& facts,
                  const ViewLenses& lenses, const SpacePose* gaze, const std::shared_ptr<LateEyes>& late);

} // namespace gsc
