// SPDX-License-Identifier: Apache-2.0
// The motions camera paths are made of, each once. A motion adds frames to a path; angles are in degrees, lengths in
// world units, headings run from axis 0 of the site towards its axis 1, `down` is below the horizon.
#pragma once

#include "convert/sample/model/model_text.h"
#include "convert/survey/path_site.h"
#include "runtime/cameras/length.h"

#include <cstdint>
#include <span>
#include <utility>

namespace gsc {

constexpr double kArmLength = 0.7;  // metres
constexpr double kWalkSpeed = 1.4;  // metres per second
constexpr double kHeadsetRate = 72; // frames per second
constexpr double kLiveRate = 90;    // frames per second of the paths that move as people do

struct PathLens {
    uint32_t width = 2048, height = 2048; // pixels
    double fov_x = 0.5 * kPi;             // radians
};

// Unit vector; the two angles in radians.
dvec3 radialDirection(const PathSite& site, double heading, double down);

struct Place {
    dvec3 position{}, forward{}; // forward is a unit vector
};

// A straight walk, gaze turning evenly from the first to the last.
struct Walk {
    Place first, last;
};

// A unit vector between the two, at an even rate. Opposite ones turn about `up`.
dvec3 turned(dvec3 from, dvec3 to, dvec3 up, double t);
Place along(const Walk& walk, dvec3 up, double t);

// Something that moves from rest to rest by `way` above 0, speeding up and slowing down for `ramp` seconds each. Its
// speed is `speed` in between, and less where the way is too short for that.
class Eased {
public:
    Eased(double way, double speed, double ramp);
    [[nodiscard]] double seconds() const { return m_way / m_speed + m_ramp; }
    // Share of the way, 0..1, at any time in seconds.
    [[nodiscard]] double share(double t) const;

private:
    double m_way, m_ramp, m_speed;
};

// A head that turns so far from straight ahead, in degrees, and stays there; the first one's turn begins straight ahead.
struct Glance {
    double heading, down, seconds;
};

// Adds frames to a path. Precondition: the site outlives it.
class PathMaker {
public:
    PathMaker(const PathSite& site, const char* name, double fps, const PathLens& lens = {});

    void look(dvec3 position, dvec3 forward);
    [[nodiscard]] dvec3 direction(double heading, double down) const
    {
        return radialDirection(m_site, degrees(heading), degrees(down));
    }
    [[nodiscard]] const PathSite& site() const { return m_site; }
    [[nodiscard]] double fps() const { return m_path.fps; }
    void eyes(double times) { m_path.ipd *= times; }
    CameraPath take() { return std::move(m_path); }

private:
    const PathSite& m_site;
    PathLens m_lens;
    CameraPath m_path;
};

// Round `target`, `step` degrees a frame, at a constant distance.
void circle(PathMaker& path, int frames, dvec3 target, double distance, double heading, double step, double down);
// Still, then `turning` frames of `step` degrees each, then still.
void turnHead(PathMaker& path, dvec3 eye, double heading, double step, int still_before, int turning, int still_after);
void stand(PathMaker& path, int frames, dvec3 position, dvec3 forward);
// Away from `target`, from distance `first` to `last`, the same factor each frame.
void recede(PathMaker& path, int frames, dvec3 target, dvec3 forward, double first, double last);
// `share` of `distance` to either side of it, `period` frames to a swing, no frame on the distance itself.
void swing(PathMaker& path, int frames, dvec3 target, dvec3 forward, double distance, double share, double period);
// Eyes at `distance` before `target` that shake by 1 mm at first and 2 cm in the end. Radians per frame of the three
// axes: rate, rate + spread, rate + 2 spread.
void shake(PathMaker& path, int frames, dvec3 target, dvec3 forward, double distance, double rate, double spread);
// A walk at kWalkSpeed from rest to rest, while the head turns to either side at 75 degrees per second.
void stroll(PathMaker& path, const Walk& walk);
constexpr double kStrollWay = 26.6; // metres: 20 seconds
// 12 seconds of a standing viewer who looks up to 90 degrees to either side, at up to 120 degrees per second.
void lookAround(PathMaker& path, dvec3 eye, double heading);

} // namespace gsc
