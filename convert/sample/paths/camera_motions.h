// SPDX-License-Identifier: Apache-2.0
// The motions that camera paths are made of. Each function adds frames to a path. Angles are in degrees and lengths in
// world units; a heading of 0 points along axis 0 of the site, 90 along axis 1; `down` is the angle below the horizon.
#pragma once

#include "convert/sample/model/model_text.h"
#include "convert/survey/path_site.h"
#include "runtime/cameras/length.h"

#include <cstdint>
#include <span>
#include <utility>

namespace gsc {

constexpr double kArmLength = 0.7;  // metres from the eye to what a hand holds
constexpr double kWalkSpeed = 1.4;  // metres per second of a walk
constexpr double kHeadsetRate = 72; // frames per second of most paths
constexpr double kLiveRate = 90;    // frames per second of the paths that move as people do

struct PathLens {
    uint32_t width = 2048, height = 2048; // size of the picture in pixels
    double fov_x = 0.5 * kPi;             // horizontal angle of view in radians
};

// Unit vector in the direction of a heading and a downward angle, both in radians.
dvec3 radialDirection(const PathSite& site, double heading, double down);

struct Place {
    dvec3 position{}, forward{}; // in world units; `forward` is a unit vector
};

// A straight walk; the view turns evenly from that of `first` to that of `last`.
struct Walk {
    Place first, last;
};

// Unit vector at share `t`, 0 to 1, of an even turn from `from` to `to`. Opposite vectors turn about `up`.
dvec3 turned(dvec3 from, dvec3 to, dvec3 up, double t);
Place along(const Walk& walk, dvec3 up, double t);

// A motion over the distance `way` > 0 that begins and ends at rest. It takes `ramp` seconds to reach `speed` and as
// many to stop; on a short way it stays slower.
class Eased {
public:
    Eased(double way, double speed, double ramp);
    [[nodiscard]] double seconds() const { return m_way / m_speed + m_ramp; }
    // Share of the way, 0 to 1, that is covered after `t` seconds; `t` may lie before or after the motion.
    [[nodiscard]] double share(double t) const;

private:
    double m_way, m_ramp, m_speed;
};

// A turn of the head to `heading` and `down`, in degrees from straight ahead, and the seconds that it stays there.
// Before the first glance the head looks straight ahead.
struct Glance {
    double heading, down, seconds;
};

// Adds frames to a path. Precondition: `site` outlives this.
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

// Circles round `target` at a constant distance, `step` degrees from frame to frame.
void circle(PathMaker& path, int frames, dvec3 target, double distance, double heading, double step, double down);
// Stands still for `still_before` frames, turns by `step` degrees in each of `turning` frames, stands still again.
void turnHead(PathMaker& path, dvec3 eye, double heading, double step, int still_before, int turning, int still_after);
void stand(PathMaker& path, int frames, dvec3 position, dvec3 forward);
// Moves away from `target`, from distance `first` to `last`, by the same factor each frame.
void recede(PathMaker& path, int frames, dvec3 target, dvec3 forward, double first, double last);
// Swings towards `target` and back by `share` of `distance`, with `period` frames to a swing. No frame lies at
// `distance` itself.
void swing(PathMaker& path, int frames, dvec3 target, dvec3 forward, double distance, double share, double period);
// Looks at `target` from `distance` while the eyes shake, by 1 mm at first and 20 mm at the end. `rate`: radians per
// frame on the first axis; each further axis has `spread` more.
void shake(PathMaker& path, int frames, dvec3 target, dvec3 forward, double distance, double rate, double spread);
// Walks at kWalkSpeed from rest to rest, while the head turns to either side at 75 degrees per second.
void stroll(PathMaker& path, const Walk& walk);
constexpr double kStrollWay = 26.6; // metres, a walk of 20 seconds
// Stands for 12 seconds and looks up to 90 degrees to either side, at up to 120 degrees per second.
void lookAround(PathMaker& path, dvec3 eye, double heading);

} // namespace gsc
