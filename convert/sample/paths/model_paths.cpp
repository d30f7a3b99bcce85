// SPDX-License-Identifier: Apache-2.0
#include "convert/sample/paths/model_paths.h"

#include "convert/sample/paths/path_places.h"
#include "convert/sample/paths/site_paths.h"
#include <gsc/error.h>
#include <gsc/interrupt.h>

#include <algorithm>
#include <cmath>

namespace gsc {

namespace {

constexpr double kSeconds = 4;      // length of most paths
constexpr double kWalkSeconds = 3;  // seconds, for 4.2 m
constexpr double kOrbitSpeed = 25;  // degrees per second of path orbit
constexpr double kAscentSpeed = 4;  // most metres per second of path ascent
constexpr double kAerialSpeed = 10; // metres per second of path aerial
// metres of leaning forward and back, once a second
constexpr double kSwingReach = 0.3;
constexpr double kShakeRate = 3;     // Hz of the slowest of the three axes
constexpr double kZoomPerSecond = 2; // factor by which the distance grows per second

struct PathOrder {
    const ModelSurvey& survey;
    const PathPlaces& places;
    double fps;

    [[nodiscard]] double metre() const { return survey.site.metre; }
    [[nodiscard]] int frames(double seconds) const { return std::max(2, int(std::lround(seconds * fps))); }
};

void walkAlong(const PathOrder& order, PathMaker& path, const Walk& walk)
{
    const dvec3 way = walk.last.position - walk.first.position;
    const double step = kWalkSpeed * order.metre() / order.fps;
    const int frames = std::max(2, int(length(way) / step) + 1);
    for (int i = 0; i < frames; ++i)
        path.look(walk.first.position + normalized(way) * (step * i),
                  turned(walk.first.forward, walk.last.forward, order.survey.site.up, i / double(frames - 1)));
}

std::string walk(const PathOrder& order, PathMaker& path)
{
    walkAlong(order, path, order.places.walk(kWalkSpeed * kWalkSeconds));
    return "a walk at 1.4 m/s where the cameras stood, at eye height in an aerial model";
}

std::string wideEyes(const PathOrder& order, PathMaker& path)
{
    path.eyes(kWideEyes);
    walkAlong(order, path, order.places.walk(kWalkSpeed * kWalkSeconds / 2));
    return "a walk at 1.4 m/s with eyes 20 times as far apart";
}

std::string walkThrough(const PathOrder& order, PathMaker& path)
{
    walkAlong(order, path, order.places.walkThrough(kWalkSpeed * kWalkSeconds));
    return "straight on at 1.4 m/s, through whatever stands there";
}

std::string ascent(const PathOrder& order, PathMaker& path)
{
    const PathSite& site = order.survey.site;
    const Walk from = order.places.walk(kWalkSpeed);
    const bool ground = order.survey.fromAbove();
    const dvec3 start = from.first.position;
    const double above = order.survey.top - dot(start, site.up);
    // in a room the ascent ends below the ceiling
    const double rise = ground ? site.view_height : std::clamp(0.8 * above, 0.5 * order.metre(), 20 * order.metre());
    const double speed = std::min(kAscentSpeed * order.metre(), rise / 2);
    const int frames = order.frames(std::min(5.0, rise / speed));
    const dvec3 ahead = normalized(from.first.forward - site.up * dot(from.first.forward, site.up));
    const dvec3 target = ground ? start + ahead * (6 * order.metre()) - site.up * (kEyeHeight * order.metre())
                                : start + from.first.forward * order.survey.viewing_distance;
    for (int i = 0; i < frames; ++i) {
        const dvec3 position = start + site.up * (speed * i / order.fps);
        path.look(position, normalized(target - position));
    }
    return formatString("rises at %.3g m/s and looks at one place, more and more downwards", speed / order.metre());
}

std::string orbit(const PathOrder& order, PathMaker& path)
{
    const double width = kOrbitSpeed * kSeconds;
    const Arc arc = order.places.arc(width);
    circle(path, order.frames(kSeconds), arc.target, arc.distance, arc.heading - 0.5 * width, kOrbitSpeed / order.fps,
           arc.down);
    return "25 degrees per second round what the cameras looked at, at a constant distance";
}

std::string zoomOut(const PathOrder& order, PathMaker& path)
{
    const Arc arc = order.places.arc(30);
    const double first = std::max(0.5 * arc.distance, 2 * order.survey.near_z);
    const int frames = order.frames(kSeconds);
    recede(path, frames, arc.target,
           path.direction(arc.heading, std::max(arc.down, order.survey.kind == CaptureKind::Aerial ? 40.0 : 15.0)),
           first, first * std::pow(kZoomPerSecond, (frames - 1) / order.fps));
    return "away from what the cameras looked at, twice as far every second; no viewer moves so";
}

std::string headTurn(const PathOrder& order, PathMaker& path)
{
    const Turn turn = order.places.turn();
    const int half = order.frames(0.5);
    turnHead(path, turn.eye, turn.heading, 180.0 / half, 0, half, half);
    return "180 degrees in 0.5 s, then 0.5 s still";
}

std::string jitter(const PathOrder& order, PathMaker& path)
{
    double distance = 0;
    const Place place = order.places.closeUp(distance);
    const double rate = 2 * kPi * kShakeRate / order.fps;
    shake(path, order.frames(kSeconds), place.position + place.forward * distance, place.forward, distance, rate,
          0.34 * rate);
    return formatString("a head %.3g m before a surface, shaking by 1 mm at first and 2 cm in the end, "
                        "at 3 to 5 Hz",
                        distance / order.metre());
}

std::string teleport(const PathOrder& order, PathMaker& path)
{
    for (const Place& place : order.places.apart(8))
        stand(path, 10, place.position, place.forward);
    return "eight places, ten still frames each";
}

std::string levelSwing(const PathOrder& order, PathMaker& path)
{
    const PathSite& site = order.survey.site;
    const Arc arc = order.places.arc(30);
    double distance = arc.distance, chosen = 0;
    dvec3 forward = radialDirection(site, degrees(arc.heading), degrees(arc.down)), target = arc.target;
    const char* about = "the distance of the cameras: the model has no levels";
    if (const std::vector<double> boundaries = levelBoundaries(site); !boundaries.empty()) {
        about = "the distance of the cameras: no anchor is as far as where a level changes";
        const Place place = order.places.amidLevels(boundaries, kSwingReach * order.metre(), chosen);
        if (chosen > 0) {
            distance = chosen;
            about = "a distance at which a level changes";
            forward = place.forward;
            target = place.position + forward * distance;
        }
    }
    const double share = std::min(0.1, kSwingReach * order.metre() / distance);
    swing(path, order.frames(kSeconds), target, forward, distance, share, order.fps);
    return formatString("four swings of %.2g m about %s", share * distance / order.metre(), about);
}

// Flies along the diagonal of the ground, within its middle half. `speed`: metres per second.
std::string fly(const PathOrder& order, PathMaker& path, double speed, double most_seconds)
{
    const FlightPace pace = flightPace(order.survey.site, speed, most_seconds, order.fps);
    double height = 0;
    const PathSite moved = order.places.flightSite(kFlightFrom, pace.to, height);
    flyDiagonal(path, moved, pace.frames, kFlightFrom, pace.to, height);
    return formatString("a flight at %.3g m/s at %.3g m, looking ahead and 25 degrees down", speed,
                        height / order.metre());
}

std::string aerial(const PathOrder& order, PathMaker& path)
{
    return fly(order, path, kAerialSpeed, kSeconds);
}

std::string flight(const PathOrder& order, PathMaker& path)
{
    return fly(order, path, flightSpeed(order.survey.site), kFlightSeconds[1]);
}

std::string stroll(const PathOrder& order, PathMaker& path)
{
    stroll(path, order.places.walk(kStrollWay));
    return "a walk at 1.4 m/s that begins and ends at rest, the head turning to either side";
}

std::string lookAround(const PathOrder& order, PathMaker& path)
{
    const Turn turn = order.places.turn();
    lookAround(path, turn.eye, turn.heading + 90);
    return "looks up to 90 degrees to either side, at up to 120 degrees per second";
}

struct NamedPath {
    const char* name;
    // adds the frames, and returns their description
    std::string (*make)(const PathOrder&, PathMaker&);
    double fps = kHeadsetRate; // frames per second if none are asked for
    // made only if the model was photographed from the air, or has no cameras
    bool flies = false;
};

constexpr NamedPath kPaths[] = {{"walk", walk},
                                {"ascent", ascent},
                                {"zoom_out", zoomOut},
                                {"orbit", orbit},
                                {"head_turn", headTurn},
                                {"jitter", jitter},
                                {"teleport", teleport},
                                {"walk_through", walkThrough},
                                {"level_swing", levelSwing},
                                {"wide_eyes", wideEyes},
                                {"aerial", aerial, kHeadsetRate, true},
                                {"flight", flight, kLiveRate, true},
                                {"stroll", stroll, kLiveRate},
                                {"look_around", lookAround, kLiveRate}};

int appearanceNear(const ModelSurvey& survey, dvec3 position)
{
    int row = -1;
    double nearest = 1e300;
    for (const SourceCamera& camera : survey.cameras) {
        const double distance = length(eyeOf(camera) - position);
        if (camera.appearance >= 0 && distance < nearest) {
            nearest = distance;
            row = camera.appearance;
        }
    }
    return row;
}

// Sets the appearance row of each frame. It is the row of the camera nearest to the middle of the path, one for all
// frames, because another row is another light; with `each_place`, that of the camera nearest to the frame.
void addAppearance(const ModelSurvey& survey, bool each_place, CameraPath& path)
{
    const int middle = appearanceNear(survey, eyeOf(path.frames[path.frames.size() / 2]));
    for (SourceCamera& frame : path.frames)
        frame.appearance = each_place ? appearanceNear(survey, eyeOf(frame)) : middle;
}

ModelPath measured(const PathPlaces& places, double metre, bool teleports, CameraPath path)
{
    ModelPath made;
    made.least_share = 1;
    for (size_t i = 0; i < path.frames.size(); ++i) {
        const SourceCamera& c = path.frames[i];
        made.least_share = std::min(made.least_share, places.share({eyeOf(c), axisOf(c, 2)}));
        if (i && !teleports)
            made.top_speed = std::max(made.top_speed, length(eyeOf(c) - eyeOf(path.frames[i - 1])) * path.fps / metre);
    }
    made.path = std::move(path);
    return made;
}

} // namespace

const std::vector<std::string>& modelPathNames()
{
    static const std::vector<std::string> names = [] {
        std::vector<std::string> all;
        for (const NamedPath& path : kPaths)
            all.push_back(path.name);
        return all;
    }();
    return names;
}

std::vector<ModelPath> modelPaths(const ModelSurvey& survey, const PathLens& lens, double fps,
                                  const std::vector<std::string>& only)
{
    const PathPlaces places(survey, lens);
    std::vector<ModelPath> made;
    for (const NamedPath& named : kPaths) {
        throwIfInterrupted();
        const bool asked = std::find(only.begin(), only.end(), named.name) != only.end();
        if (!only.empty() && !asked)
            continue;
        if (named.flies && !survey.fromAbove()) {
            if (asked)
                throw Error(ErrorCode::Usage, "--only", "the cameras of this model stand on the ground",
                            formatString("some in the air for the path %s", named.name), "leave it out");
            continue;
        }
        const bool teleports = named.make == teleport;
        const PathOrder order{survey, places, fps > 0 ? fps : named.fps};
        PathMaker maker(survey.site, named.name, order.fps, lens);
        std::string description = named.make(order, maker);
        CameraPath path = maker.take();
        path.metre = survey.site.metre;
        path.description = std::move(description) + "; " + survey.metre_rule;
        addAppearance(survey, teleports, path);
        made.push_back(measured(places, survey.site.metre, teleports, std::move(path)));
    }
    return made;
}

} // namespace gsc
