// SPDX-License-Identifier: Apache-2.0
// A run to measure: how its frames are drawn, and by which backend.
#pragma once

#include "player/options/frame_choice.h"

#include <string>

namespace gsc {

struct RunConfig : FrameChoice {
    std::string backend = "auto";
    bool match_budget = false; // the decode budget is what the run of depthRunOf() decodes
};

} // namespace gsc
