// SPDX-License-Identifier: Apache-2.0
// The place that a viewer moves about in: ground, scale and levels of detail.
#pragma once

#include "convert/survey/ground_frame.h"
#include <gsc/gsc_layout.h>

#include <cstdint>

namespace gsc {

constexpr double kEyeHeight = 1.6; // metres above the ground

constexpr double degrees(double angle)
{
    return angle * kPi / 180;
}

// The place that a set of paths is made for, in world units unless a field says otherwise. low and high are the edges
// of the built ground; the model was photographed from about view_height.
struct PathSite : GroundFrame {
    double metre = 1; // world units that stand for one metre of a viewer's body
    // Octree-GS's choice of a level: rounded log(standard_dist / distance) / log(fork), between 0 and finest_level.
    // level_rule tells how it is rounded.
    LevelRule level_rule = LevelRule::None;
    double standard_dist = 0;
    uint32_t fork = 2;
    int32_t finest_level = 0;
};

} // namespace gsc
