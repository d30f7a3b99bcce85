// SPDX-License-Identifier: Apache-2.0
// The place that a viewer moves about in: its ground, its scale and its levels of detail.
#pragma once

#include "convert/survey/ground_frame.h"
#include <gsc/gsc_layout.h>

#include <cstdint>

namespace gsc {

constexpr double kEyeHeight = 1.6; // metres

constexpr double degrees(double angle)
{
    return angle * kPi / 180;
}

// The place a set of paths is made for. World units, unless a field says otherwise. `low` and `high` are those of the
// built ground; the model was photographed from `view_height`.
struct PathSite : GroundFrame {
    double metre = 1; // world units that stand for one metre of a viewer's body
    // Octree-GS: level = round_rule(log(standard_dist / distance) / log(fork)) in 0..finest_level
    LevelRule level_rule = LevelRule::None;
    double standard_dist = 0;
    uint32_t fork = 2;
    int32_t finest_level = 0;
};

} // namespace gsc
