// SPDX-License-Identifier: Apache-2.0
// Turns a headset's pose into a request for pictures: a camera for each eye, in pairs.
#pragma once

#include "player/poses/placement.h"
#include "player/present/headset/headset.h"
#include "player/xr/late_eyes.h"
#include "player/xr/view_lenses.h"
#include "player/xr/view_source.h"

#include <memory>

namespace gsc {

// Fills `views`, whose `eyes` are set, for a space at `place`. `lens` gives name, planes and appearance of the cameras,
// `facts` size and format. `gaze` may be null; so may `late`, which locates the eyes again when drawing begins.
void requestViews(AskedViews& views, const Shot& lens, const Placement& place, const HeadsetFacts& facts,
                  const ViewLenses& lenses, const SpacePose* gaze, const std::shared_ptr<LateEyes>& late);

} // namespace gsc
