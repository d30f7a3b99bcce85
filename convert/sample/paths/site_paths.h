// SPDX-License-Identifier: Apache-2.0
// Camera paths of a site whose ground is known, as that of a sample is: an ordinary flight, paths that are hard for
// reuse, merging and levels of detail, and paths that move as people do. Paths of a model that has to be surveyed first
// are made in model_paths.h.
#pragma once

#include "convert/sample/paths/camera_motions.h"
#include "format/file/new_folder.h"

#include <string>
#include <vector>

namespace gsc {

// Distances from the camera, in world units, at which an anchor without extra level changes its level; the largest
// first. Empty if there is only one level.
std::vector<double> levelBoundaries(const PathSite& site);
// The value of levelBoundaries() whose ratio to `near_to` is closest to 1; `near_to` itself if there is none.
double levelBoundary(const PathSite& site, double near_to);

// The point on the ground at which orbit, zoom_out and level_swing look.
dvec3 pathTarget(const PathSite& site);

constexpr double kWideEyes = 20; // times the usual distance of the eyes, for path wide_eyes

// Flies along the diagonal of the ground from share `from` to share `to` of it, `height` world units above it, looking
// ahead and 25 degrees down.
void flyDiagonal(PathMaker& path, const PathSite& site, int frames, double from, double to, double height);

// Frames of a flight along the diagonal, and the share of the diagonal at which it ends; it begins at kFlightFrom and
// covers at most half of the diagonal.
struct FlightPace {
    int frames = 0;
    double to = 0;
};
constexpr double kFlightFrom = 0.25;
// Pace of a flight at `speed` metres per second that takes at most `most_seconds`.
FlightPace flightPace(const PathSite& site, double speed, double most_seconds, double fps);

constexpr double kFlightSpeed = 25; // metres per second of path `flight`
// least and most seconds of the flight; on small ground it is slower, to take the least
constexpr double kFlightSeconds[] = {2, 20};
double flightSpeed(const PathSite& site);

// Makes aerial, orbit, head_turn, teleport, zoom_out, walk_through, level_swing, jitter and wide_eyes, whose frames may
// be metres apart, and flight, stroll and look_around, which move as people do, at kLiveRate. Equal sites give equal
// frames. Precondition: low < high; view_height and metre are above 0.
std::vector<CameraPath> sitePaths(const PathSite& site);

constexpr const char* kFirstPath = "paths/aerial.json"; // path in the model folder
// Writes paths/NAME.json for each path.
void writeSitePaths(const NewFolder& folder, const std::vector<CameraPath>& paths);

} // namespace gsc
