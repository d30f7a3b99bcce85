// SPDX-License-Identifier: Apache-2.0
#include "convert/sample/paths/model_paths.h"

#include "convert/sample/paths/camera_paths.h"
#include "convert/sample/paths/path_places.h"
#include "format/error.h"
#include "format/interrupt.h"

#include <algorithm>
#include <cmath>

namespace gsc {

namespace {

constexpr double kSeconds = 4;       // of most paths
constexpr double kWalkSeconds = 3;   // 4.2 m
constexpr double kOrbitSpeed = 25;   // degrees per second
constexpr double kAscentSpeed = 4;   // metres per second
constexpr double kFlightSpeed = 10;  // metres per second
constexpr double kSwingReach = 0.3;  // metres to either side: leaning forward and back once a second
constexpr double kShakeRate = 3;     // Hz of the slowest axis
constexpr double kZoomPerSecond = 2; // times as far

struct PathOrder {
    const ModelSurvey& survey;
    const PathPlaces& places;
    PathLens lens;
    double fps;

    [[nodiscard]] double metre() const { return survey.site.metre; }
    [[nodiscard]] int frames(double seconds) const { return std::max(2, int(std::lround(seconds * fps))); }
    [[nodiscard]] PathMaker maker(const char* name) const { return {survey.site, name, fps, lens}; }
};

CameraPath described(PathMaker& maker, std::string text)
{
    CameraPath path = maker.take();
    path.description = std::move(text);
    return path;
}

void walkAlong(const PathOrder& order, PathMaker& path, const Walk& walk)
{
    const Vec3 way = walk.last.position - walk.first.position;
    const double step = kWalkSpeed * order.metre() / order.fps;
    const int frames = std::max(2, int(length(way) / step) + 1);
    const Vec3 up = order.survey.site.up;
    moveAlong(
        path, frames, walk.first.position, normalized(way), [step](int i) { return step * i; },
        [&walk, frames, up](int i, Vec3) {
            return turned(walk.first.forward, walk.last.forward, up, i / double(frames - 1));
        });
}

CameraPath walk(const PathOrder& order)
{
    PathMaker path = order.maker("walk");
    walkAlong(order, path, order.places.walk(kWalkSpeed * kWalkSeconds));
    return described(path, "a walk at 1.4 m/s where the cameras stood, at eye height in an aerial model");
}

CameraPath wideEyes(const PathOrder& order)
{
    PathMaker path = order.maker("wide_eyes");
    path.eyes(kWideEyes);
    walkAlong(order, path, order.places.walk(kWalkSpeed * kWalkSeconds / 2));
    return described(path, "a walk at 1.4 m/s with eyes 20 times as far apart");
}

CameraPath walkThrough(const PathOrder& order)
{
    PathMaker path = order.maker("walk_through");
    walkAlong(order, path, order.places.walkThrough(kWalkSpeed * kWalkSeconds));
    return described(path, "straight on at 1.4 m/s, through whatever stands there");
}

CameraPath ascent(const PathOrder& order)
{
    const PathSite& site = order.survey.site;
    const Walk from = order.places.walk(kWalkSpeed);
    const bool ground = order.survey.kind == CaptureKind::Aerial || order.survey.kind == CaptureKind::None;
    const Vec3 start = from.first.position;
    const double above = order.survey.top - dot(start, site.up);
    // rooms end at their ceiling
    const double rise = ground ? site.view_height : std::clamp(0.8 * above, 0.5 * order.metre(), 20 * order.metre());
    const double speed = std::min(kAscentSpeed * order.metre(), rise / 2);
    const int frames = order.frames(std::min(5.0, rise / speed));
    const Vec3 ahead = normalized(from.first.forward - site.up * dot(from.first.forward, site.up));
    const Vec3 target = ground ? start + ahead * (6 * order.metre()) - site.up * (kEyeHeight * order.metre())
                               : start + from.first.forward * order.survey.viewing_distance;
    PathMaker path = order.maker("ascent");
    moveAlong(
        path, frames, start, site.up, [&](int i) { return speed * i / order.fps; },
        [target](int, Vec3 position) { return normalized(target - position); });
    return described(
        path, formatString("rises at %.3g m/s and looks at one place, more and more downwards", speed / order.metre()));
}

CameraPath orbit(const PathOrder& order)
{
    const double width = kOrbitSpeed * kSeconds;
    const Arc arc = order.places.arc(width);
    PathMaker path = order.maker("orbit");
    circle(path, order.frames(kSeconds), arc.target, arc.distance, arc.heading - 0.5 * width, kOrbitSpeed / order.fps,
           arc.down);
    return described(path, "25 degrees per second round what the cameras looked at, at a constant distance");
}

CameraPath zoomOut(const PathOrder& order)
{
    const Arc arc = order.places.arc(30);
    PathMaker path = order.maker("zoom_out");
    const double first = std::max(0.5 * arc.distance, 2 * order.survey.near_z);
    const int frames = order.frames(kSeconds);
    recede(path, frames, arc.target,
           path.direction(arc.heading, std::max(arc.down, order.survey.kind == CaptureKind::Aerial ? 40.0 : 15.0)),
           first, first * std::pow(kZoomPerSecond, (frames - 1) / order.fps));
    return described(path, "away from what the cameras looked at, twice as far every second; no viewer moves so");
}

CameraPath headTurn(const PathOrder& order)
{
    double heading = 0;
    const Vec3 eye = order.places.turn(heading);
    PathMaker path = order.maker("head_turn");
    const int half = order.frames(0.5);
    turnHead(path, eye, heading, 180.0 / half, 0, half, half);
    return described(path, "180 degrees in 0.5 s, then 0.5 s still");
}

CameraPath jitter(const PathOrder& order)
{
    double distance = 0;
    const Place place = order.places.closeUp(distance);
    PathMaker path = order.maker("jitter");
    const double rate = 2 * kPi * kShakeRate / order.fps;
    shake(path, order.frames(kSeconds), place.position + place.forward * distance, place.forward, distance, rate,
          0.34 * rate);
    return described(path, formatString("a head %.3g m before a surface, shaking by 1 mm at first and 2 cm in the end, "
                                        "at 3 to 5 Hz",
                                        distance / order.metre()));
}

CameraPath teleport(const PathOrder& order)
{
    PathMaker path = order.maker("teleport");
    for (const Place& place : order.places.apart(8))
        stand(path, 10, place.position, place.forward);
    return described(path, "eight places, ten still frames each");
}

CameraPath levelSwing(const PathOrder& order)
{
    const PathSite& site = order.survey.site;
    const Arc arc = order.places.arc(30);
    double distance = arc.distance, chosen = 0;
    Vec3 forward = radialDirection(site, degrees(arc.heading), degrees(arc.down)), target = arc.target;
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
    PathMaker path = order.maker("level_swing");
    swing(path, order.frames(kSeconds), target, forward, distance, share, order.fps);
    return described(path, formatString("four swings of %.2g m about %s", share * distance / order.metre(), about));
}

CameraPath aerial(const PathOrder& order)
{
    const PathSite& site = order.survey.site;
    const double diagonal = std::hypot(site.high[0] - site.low[0], site.high[1] - site.low[1]);
    // as far as the middle half of the diagonal goes
    const int frames = int(
        std::clamp(0.5 * diagonal / (kFlightSpeed * order.metre()) * order.fps, 2.0, double(order.frames(kSeconds))));
    const double part = (frames - 1) * kFlightSpeed * order.metre() / order.fps / diagonal;
    double height = 0;
    const PathSite moved = order.places.flightSite(0.25, 0.25 + part, height);
    PathMaker path(moved, "aerial", order.fps, order.lens);
    flyDiagonal(path, frames, 0.25, 0.25 + part, height);
    return described(
        path, formatString("a flight at 10 m/s at %.3g m, looking ahead and 25 degrees down", height / order.metre()));
}

struct NamedPath {
    const char* name;
    CameraPath (*make)(const PathOrder&);
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
                                {"aerial", aerial}};

bool fliesOver(const ModelSurvey& survey)
{
    return survey.kind == CaptureKind::Aerial || survey.kind == CaptureKind::None;
}

int appearanceNear(const ModelSurvey& survey, Vec3 position)
{
    int row = -1;
    double nearest = 1e300;
    for (const SurveyCamera& camera : survey.cameras) {
        const double distance = length(camera.view.position - position);
        if (camera.appearance >= 0 && distance < nearest) {
            nearest = distance;
            row = camera.appearance;
        }
    }
    return row;
}

// The row of the camera nearest to the path's middle: one for all frames, because a change of row is a change of light.
void addAppearance(const ModelSurvey& survey, bool each_place, CameraPath& path)
{
    const int middle = appearanceNear(survey, path.frames[path.frames.size() / 2].position);
    for (NamedCamera& frame : path.frames)
        frame.appearance = each_place ? appearanceNear(survey, frame.position) : middle;
}

ModelPath measured(const PathPlaces& places, double metre, bool teleports, CameraPath path)
{
    ModelPath made;
    made.least_share = 1;
    for (size_t i = 0; i < path.frames.size(); ++i) {
        const NamedCamera& c = path.frames[i];
        made.least_share =
            std::min(made.least_share, places.share({c.position, {c.rotation[2], c.rotation[5], c.rotation[8]}}));
        if (i && !teleports)
            made.top_speed =
                std::max(made.top_speed, length(c.position - path.frames[i - 1].position) * path.fps / metre);
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
    const PathOrder order{survey, places, lens, fps};
    std::vector<ModelPath> made;
    for (const NamedPath& named : kPaths) {
        throwIfInterrupted();
        const bool asked = std::find(only.begin(), only.end(), named.name) != only.end();
        if (!only.empty() && !asked)
            continue;
        if (named.make == aerial && !fliesOver(survey)) {
            if (asked)
                throw Error(ErrorCode::Usage, "--only: the cameras of this model stand on the ground, expected some in "
                                              "the air for the path aerial; leave it out");
            continue;
        }
        const bool teleports = named.make == teleport;
        CameraPath path = named.make(order);
        path.metre = survey.site.metre;
        path.description += "; " + survey.metre_rule;
        addAppearance(survey, teleports, path);
        made.push_back(measured(places, survey.site.metre, teleports, std::move(path)));
    }
    return made;
}

} // namespace gsc
