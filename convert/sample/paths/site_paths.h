// SPDX-License-Identifier: Apache-2.0
// Camera paths of a site whose ground is known, as a sample's is: an ordinary flight, and those made to break reuse,
// merging and LOD; and some that move as people do. Those of a model that has to be surveyed first are in model_paths.h.
#pragma once

#include "convert/sample/paths/camera_motions.h"
#include "format/file/new_folder.h"

#include <string>
#include <vector>

namespace gsc {

// Distances from the camera at which an anchor without extra level changes its level, the coarsest level's first;
// empty where there are no two levels.
std::vector<double> levelBoundaries(const PathSite& site);
// The distance closest to `near_to` by ratio; `near_to` itself if there is none.
double levelBoundary(const PathSite& site, double near_to);

// The point on the ground that orbit, zoom_out and level_swing look at.
dvec3 pathTarget(const PathSite& site);

constexpr double kWideEyes = 20; // times as far apart as eyes are

// From `from` to `to` of the diagonal of the site's ground, 0..1, `height` above it, looking ahead and 25 degrees down.
void flyDiagonal(PathMaker& path, const PathSite& site, int frames, double from, double to, double height);

// A flight from `kFlightFrom` to `to` of the diagonal: at most half of it.
struct FlightPace {
    int frames = 0;
    double to = 0;
};
constexpr double kFlightFrom = 0.25;
// At `speed` metres per second, for `most_seconds` at most.
FlightPace flightPace(const PathSite& site, double speed, double most_seconds, double fps);

constexpr double kFlightSpeed = 25;          // speed of `flight`, metres per second
constexpr double kFlightSeconds[] = {2, 20}; // slower where the ground is too small for the first
double flightSpeed(const PathSite& site);

// aerial, orbit, head_turn, teleport, zoom_out, walk_through, level_swing, jitter, wide_eyes, whose frames may be metres
// apart, and flight, stroll, look_around, which move as people do, at kLiveRate: same site, same frames.
// Precondition: low < high, view_height and metre above 0.
std::vector<CameraPath> sitePaths(const PathSite& site);

constexpr const char* kFirstPath = "paths/aerial.json"; // path in the model folder
// paths/NAME.json of each.
void writeSitePaths(const NewFolder& folder, const std::vector<CameraPath>& paths);

} // namespace gsc
