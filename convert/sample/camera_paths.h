// SPDX-License-Identifier: Apache-2.0
// Camera paths for measuring a player: an ordinary flight, and those made to break reuse, merging and LOD.
#pragma once

#include "convert/sample/model_folder.h"
#include "convert/sample/model_text.h"
#include "convert/sample/vec3.h"
#include "format/gsc_layout.h"

#include <cstdint>
#include <string>
#include <vector>

namespace gsc {

constexpr double kEyeDistance = 0.064; // metres

// The place a set of paths is made for. World units, unless a field says otherwise.
struct PathSite {
    Vec3 axis[2], up;                 // unit vectors, right-handed
    double low[2] = {}, high[2] = {}; // of the built ground, along the axes
    double ground = 0;                // along up
    double view_height = 0;           // above ground, from which the model was photographed
    double metre = 1;                 // world units that stand for one metre of a viewer's body
    // Octree-GS: level = round_rule(log(standard_dist / distance) / log(fork)) in 0..finest_level
    LevelRule level_rule = LevelRule::None;
    double standard_dist = 0;
    uint32_t fork = 2;
    int32_t finest_level = 0;
};

struct CameraPath {
    std::string name; // of the file too
    double fps = 0, ipd = 0;
    std::vector<NamedCamera> frames;
};

// Distance from the camera at which an anchor without extra level changes its level, the one closest to `near_to` by
// ratio; `near_to` itself where there are no two levels.
double levelBoundary(const PathSite& site, double near_to);

// The point on the ground that orbit, zoom_out and level_swing look at.
Vec3 pathTarget(const PathSite& site);

// aerial, orbit, head_turn, teleport, zoom_out, walk_through, level_swing, jitter, wide_eyes: same site, same frames.
// Precondition: low < high, view_height and metre above 0.
std::vector<CameraPath> cameraPaths(const PathSite& site);

// paths/NAME.json of each; returns where aerial.json lies, relative to the model folder.
std::string writeCameraPaths(const ModelFolder& folder, const std::vector<CameraPath>& paths);

} // namespace gsc
