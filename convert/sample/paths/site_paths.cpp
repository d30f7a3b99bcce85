// SPDX-License-Identifier: Apache-2.0
#include "convert/sample/paths/site_paths.h"

#include <gsc/error.h>

#include <algorithm>
#include <cmath>

namespace gsc {

namespace {

// A point `height` above the ground. u and v are shares, 0 to 1, of the two sides of the ground.
dvec3 above(const PathSite& site, double u, double v, double height)
{
    return site.axis[0] * lerp(site.low[0], site.high[0], u) + site.axis[1] * lerp(site.low[1], site.high[1], v) +
           site.up * (site.ground + height);
}

double side(const PathSite& site, int axis)
{
    return site.high[axis] - site.low[axis];
}

// Heading of the ground's diagonal, in radians.
double diagonal(const PathSite& site)
{
    return std::atan2(side(site, 1), side(site, 0));
}

double eyeHeight(const PathSite& site)
{
    return kEyeHeight * site.metre;
}

void aerial(const PathSite& site, PathMaker& path)
{
    flyDiagonal(path, site, 40, kFlightFrom, 0.75, 0.5 * site.view_height);
}

void orbit(const PathSite& site, PathMaker& path)
{
    circle(path, 120, pathTarget(site), site.view_height, 0, 1, 35);
}

void headTurn(const PathSite& site, PathMaker& path)
{
    // turns by 180 degrees in 36 frames of 1/72 s
    turnHead(path, above(site, 0.5, 0.5, eyeHeight(site)), 0, 5, 18, 36, 18);
}

void teleport(const PathSite& site, PathMaker& path)
{
    // per place: two shares (0 to 1) of the sides of the ground, height (0 = eye height, 1 = view height), heading and
    // downward angle in degrees
    static constexpr double kPlaces[8][5] = {
        {0.30, 0.30, 0, 45, 0}, {0.70, 0.60, 0.5, 200, 30}, {0.20, 0.75, 0, 300, 0}, {0.80, 0.20, 1, 135, 50},
        {0.50, 0.50, 0, 0, 0},  {0.25, 0.50, 0.25, 20, 15}, {0.75, 0.80, 0, 225, 0}, {0.40, 0.20, 0.75, 90, 40}};
    for (const auto& place : kPlaces)
        stand(path, 10, above(site, place[0], place[1], lerp(eyeHeight(site), site.view_height, place[2])),
              path.direction(place[3], place[4]));
}

void zoomOut(const PathSite& site, PathMaker& path)
{
    const double last = std::max(4 * site.view_height, std::hypot(side(site, 0), side(site, 1)));
    recede(path, 100, pathTarget(site), radialDirection(site, diagonal(site), degrees(50)), 0.25 * site.view_height,
           last);
}

void walkThrough(const PathSite& site, PathMaker& path)
{
    // a heading off the axes of the ground, because a street along an axis would lead past everything
    const double heading = 0.6 * diagonal(site);
    const double way =
        std::min(30 * site.metre, 0.8 * std::min(side(site, 0) / std::cos(heading), side(site, 1) / std::sin(heading)));
    const dvec3 forward = radialDirection(site, heading, 0);
    for (int i = 0; i < 120; ++i)
        path.look(above(site, 0.5, 0.5, eyeHeight(site)) + forward * (way * (i / 119.0 - 0.5)), forward);
}

void levelSwing(const PathSite& site, PathMaker& path)
{
    swing(path, 96, pathTarget(site), radialDirection(site, diagonal(site), degrees(40)),
          levelBoundary(site, site.view_height), 0.1, 24); // reach and frames per swing: four swings
}

void jitter(const PathSite& site, PathMaker& path)
{
    shake(path, 120, pathTarget(site), radialDirection(site, diagonal(site), degrees(45)), kArmLength * site.metre, 1.1,
          0.37);
}

void wideEyes(const PathSite& site, PathMaker& path)
{
    path.eyes(kWideEyes);
    const double heading = diagonal(site);
    const dvec3 way = radialDirection(site, heading, 0), forward = radialDirection(site, heading, degrees(5));
    for (int i = 0; i < 60; ++i)
        path.look(above(site, 0.5, 0.5, eyeHeight(site)) + way * (kWalkSpeed * site.metre * i / kHeadsetRate), forward);
}

void flight(const PathSite& site, PathMaker& path)
{
    const FlightPace pace = flightPace(site, flightSpeed(site), kFlightSeconds[1], path.fps());
    flyDiagonal(path, site, pace.frames, kFlightFrom, pace.to, 0.5 * site.view_height);
}

// Walks along the middle of the ground, which is the street or often one of a city's streets.
void stroll(const PathSite& site, PathMaker& path)
{
    const dvec3 forward = radialDirection(site, 0, 0), middle = above(site, 0.5, 0.5, eyeHeight(site));
    const dvec3 half = forward * (0.5 * std::min(kStrollWay * site.metre, 0.8 * side(site, 0)));
    stroll(path, {{middle - half, forward}, {middle + half, forward}});
}

void lookAround(const PathSite& site, PathMaker& path)
{
    lookAround(path, above(site, 0.5, 0.5, eyeHeight(site)), 0);
}

struct NamedSitePath {
    const char* name;
    double fps;
    void (*make)(const PathSite&, PathMaker&); // adds the frames to the path
};

constexpr NamedSitePath kSitePaths[] = {{"aerial", 30, aerial},
                                        {"orbit", kHeadsetRate, orbit},
                                        {"head_turn", kHeadsetRate, headTurn},
                                        {"teleport", kHeadsetRate, teleport},
                                        {"zoom_out", kHeadsetRate, zoomOut},
                                        {"walk_through", kHeadsetRate, walkThrough},
                                        {"level_swing", kHeadsetRate, levelSwing},
                                        {"jitter", kHeadsetRate, jitter},
                                        {"wide_eyes", kHeadsetRate, wideEyes},
                                        {"flight", kLiveRate, flight},
                                        {"stroll", kLiveRate, stroll},
                                        {"look_around", kLiveRate, lookAround}};

} // namespace

FlightPace flightPace(const PathSite& site, double speed, double most_seconds, double fps)
{
    const double way = std::hypot(side(site, 0), side(site, 1));
    const double most = std::max(2.0, std::round(most_seconds * fps));
    FlightPace pace;
    pace.frames = int(std::clamp(0.5 * way / (speed * site.metre) * fps, 2.0, most));
    pace.to = kFlightFrom + (pace.frames - 1) * speed * site.metre / fps / way;
    return pace;
}

double flightSpeed(const PathSite& site)
{
    return std::min(kFlightSpeed, 0.5 * std::hypot(side(site, 0), side(site, 1)) / site.metre / kFlightSeconds[0]);
}

void flyDiagonal(PathMaker& path, const PathSite& site, int frames, double from, double to, double height)
{
    const dvec3 forward = radialDirection(site, diagonal(site), degrees(25));
    for (int i = 0; i < frames; ++i) {
        const double t = from + (to - from) * i / (frames - 1);
        path.look(above(site, t, t, height), forward);
    }
}

dvec3 pathTarget(const PathSite& site)
{
    return site.axis[0] * (0.5 * (site.low[0] + site.high[0])) + site.axis[1] * (0.5 * (site.low[1] + site.high[1])) +
           site.up * site.ground;
}

std::vector<double> levelBoundaries(const PathSite& site)
{
    std::vector<double> boundaries;
    if (site.level_rule == LevelRule::None || !(site.standard_dist > 0) || site.finest_level < 1 || site.fork < 2)
        return boundaries;
    // value of log(standard_dist / distance) / log(fork) at which level 0 changes to level 1
    const double first = site.level_rule == LevelRule::Floor ? 1 : site.level_rule == LevelRule::Round ? 0.5 : 0;
    for (int32_t k = 0; k < site.finest_level; ++k)
        boundaries.push_back(site.standard_dist * std::pow(double(site.fork), -(first + double(k))));
    return boundaries;
}

double levelBoundary(const PathSite& site, double near_to)
{
    double nearest = near_to, least = 1e300;
    for (const double boundary : levelBoundaries(site))
        if (const double ratio = std::abs(std::log(boundary / near_to)); ratio < least) {
            least = ratio;
            nearest = boundary;
        }
    return nearest;
}

std::vector<CameraPath> sitePaths(const PathSite& site)
{
    std::vector<CameraPath> made;
    for (const NamedSitePath& named : kSitePaths) {
        PathMaker path(site, named.name, named.fps);
        named.make(site, path);
        made.push_back(path.take());
    }
    return made;
}

void writeSitePaths(const NewFolder& folder, const std::vector<CameraPath>& paths)
{
    for (const CameraPath& path : paths)
        folder.append("paths/" + path.name + ".json", trajectoryJson(path));
}

} // namespace gsc
