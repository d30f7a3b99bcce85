// SPDX-License-Identifier: Apache-2.0
// Settings of a run to measure: options of its frames, and the backend.
#pragma once

#include "player/options/frame_choice.h"

#include <string>

namespace gsc {

struct RunConfig : FrameChoice {
    std::string backend = "auto";
    bool match_budget = false; // the decode budget is the mean of decodes of the run depthRunOf()
};

} // namespace gsc
