// SPDX-License-Identifier: Apache-2.0
// Turns the headset's located eyes into a request for pictures: a camera for each eye, in pairs.
#pragma once

#include "player/poses/placement.h"
#include "player/present/headset/headset.h"
#include "player/xr/late_eyes.h"
#include "player/xr/view_lenses.h"
#include "player/xr/view_source.h"

#include <memory>

namespace gsc {

// Fills the rest of `views`, whose `eyes` are set, for a space at `place`. `lens` gives name, planes and appearance of
// the cameras, `facts` gives size and format. `gaze`, if not null, is where the eyes look; `late`, if not null,
// locates the eyes again when drawing begins.
void requestViews(AskedViews& views, const Shot& lens, const Placement& place, const HeadsetFacts& facts,
                  const ViewLenses& lenses, const SpacePose* gaze, const std::shared_ptr<LateEyes>& late);

} // namespace gsc
