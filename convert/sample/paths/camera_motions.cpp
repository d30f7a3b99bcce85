// SPDX-License-Identifier: Apache-2.0
#include "convert/sample/paths/camera_motions.h"

#include "convert/survey/camera_view.h"
#include <gsc/error.h>

#include <algorithm>
#include <cmath>

namespace gsc {

namespace {

constexpr double kWalkRamp = 1, kHeadRamp = 0.3;       // seconds until a walk or a turn of the head has its full speed
constexpr double kStrollTurns = 75, kQuickTurns = 120; // degrees per second of a turning head
constexpr double kLookSeconds = 12;

constexpr Glance kStrollGlances[] = {{0, 5, 0.5},  {45, -5, 1.2}, {0, 10, 1.8},  {-70, -8, 1}, {-20, 0, 0.8},
                                     {0, 15, 1.2}, {60, 0, 1.2},  {-35, -10, 1}, {0, 0, 0}};
constexpr Glance kLookGlances[] = {{40, 0, 0.4},  {-50, 10, 0.5},  {90, -10, 0.4}, {20, 25, 0.6},
                                   {-90, 0, 0.4}, {-20, -20, 0.5}, {60, 0, 0.4},   {0, 0, 0}};

// Angles of the head at `t` seconds after the first glance began. `speed`: degrees per second.
Glance glanceAt(std::span<const Glance> glances, double speed, double t)
{
    Glance from{};
    for (const Glance& to : glances) {
        const Eased turn(std::hypot(to.heading - from.heading, to.down - from.down), speed, kHeadRamp);
        if (t < turn.seconds()) {
            const double share = turn.share(t);
            return {lerp(from.heading, to.heading, share), lerp(from.down, to.down, share), 0};
        }
        from = to;
        t -= turn.seconds() + to.seconds;
        if (t < 0)
            break;
    }
    return from;
}

} // namespace

dvec3 radialDirection(const PathSite& site, double heading, double down)
{
    const dvec3 level = site.axis[0] * std::cos(heading) + site.axis[1] * std::sin(heading);
    return level * std::cos(down) - site.up * std::sin(down);
}

dvec3 turned(dvec3 from, dvec3 to, dvec3 up, double t)
{
    const double angle = std::atan2(length(cross(from, to)), dot(from, to));
    if (angle < 1e-9)
        return from;
    dvec3 side = to - from * dot(to, from);
    if (angle > kPi - 1e-6)
        side = cross(up, from);
    return normalized(from * std::cos(angle * t) + normalized(side) * std::sin(angle * t));
}

Place along(const Walk& walk, dvec3 up, double t)
{
    return {lerp(walk.first.position, walk.last.position, t), turned(walk.first.forward, walk.last.forward, up, t)};
}

Eased::Eased(double way, double speed, double ramp) : m_way(way), m_ramp(ramp), m_speed(std::min(speed, way / ramp)) {}

double Eased::share(double t) const
{
    // way covered in `s` seconds of speeding up: the acceleration is half a sine wave, so that nothing jerks
    const auto ramp = [this](double s) { return 0.5 * s - m_ramp / (2 * kPi) * std::sin(kPi * s / m_ramp); };
    const double left = seconds() - t;
    if (t <= 0 || left <= 0)
        return t <= 0 ? 0 : 1;
    const double rate = m_speed / m_way;
    return t < m_ramp ? rate * ramp(t) : left < m_ramp ? 1 - rate * ramp(left) : rate * (t - 0.5 * m_ramp);
}

PathMaker::PathMaker(const PathSite& site, const char* name, double fps, const PathLens& lens)
    : m_site(site), m_lens(lens)
{
    m_path.name = name;
    m_path.fps = fps;
    m_path.metre = site.metre;
    m_path.ipd = kEyesApart * site.metre;
}

void PathMaker::look(dvec3 position, dvec3 forward)
{
    std::string name = formatString("%s_%04zu", m_path.name.c_str(), m_path.frames.size());
    m_path.frames.push_back(lookingAlong(position, forward, m_site.up, m_lens.width, m_lens.height, m_lens.fov_x));
    m_path.frames.back().name = std::move(name);
}

void circle(PathMaker& path, int frames, dvec3 target, double distance, double heading, double step, double down)
{
    for (int i = 0; i < frames; ++i) {
        const dvec3 forward = path.direction(heading + step * i, down);
        path.look(target - forward * distance, forward);
    }
}

void turnHead(PathMaker& path, dvec3 eye, double heading, double step, int still_before, int turning, int still_after)
{
    for (int i = 0; i < still_before + turning + still_after; ++i)
        path.look(eye, path.direction(heading + step * std::clamp(i - still_before, 0, turning), 0));
}

void stand(PathMaker& path, int frames, dvec3 position, dvec3 forward)
{
    for (int i = 0; i < frames; ++i)
        path.look(position, forward);
}

void recede(PathMaker& path, int frames, dvec3 target, dvec3 forward, double first, double last)
{
    for (int i = 0; i < frames; ++i)
        path.look(target - forward * (first * std::pow(last / first, i / double(frames - 1))), forward);
}

void swing(PathMaker& path, int frames, dvec3 target, dvec3 forward, double distance, double share, double period)
{
    for (int i = 0; i < frames; ++i)
        path.look(target - forward * (distance * (1 + share * std::sin(2 * kPi * (i + 0.5) / period))), forward);
}

void shake(PathMaker& path, int frames, dvec3 target, dvec3 forward, double distance, double rate, double spread)
{
    const PathSite& site = path.site();
    const dvec3 axes[3] = {site.axis[0], site.axis[1], site.up};
    for (int i = 0; i < frames; ++i) {
        // 1 mm at the first frame, 20 mm at the last; the axes shake at rates without a common period
        const double reach = 0.001 * std::pow(20.0, i / double(frames - 1)) * site.metre;
        dvec3 eye = target - forward * distance;
        for (int axis = 0; axis < 3; ++axis)
            eye = eye + axes[axis] * (reach * std::sin(i * (rate + spread * axis) + axis));
        path.look(eye, normalized(target - eye));
    }
}

void stroll(PathMaker& path, const Walk& walk)
{
    const PathSite& site = path.site();
    const Eased pace(length(walk.last.position - walk.first.position), kWalkSpeed * site.metre, kWalkRamp);
    for (int i = 0; i < int(std::lround(pace.seconds() * path.fps())); ++i) {
        const double t = i / path.fps();
        const auto [position, ahead] = along(walk, site.up, pace.share(t));
        const Glance glance = glanceAt(kStrollGlances, kStrollTurns, t - kWalkRamp);
        path.look(position,
                  radialDirection(
                      site, std::atan2(dot(ahead, site.axis[1]), dot(ahead, site.axis[0])) + degrees(glance.heading),
                      std::asin(std::clamp(-dot(ahead, site.up), -1.0, 1.0)) + degrees(glance.down)));
    }
}

void lookAround(PathMaker& path, dvec3 eye, double heading)
{
    for (int i = 0; i < int(std::lround(kLookSeconds * path.fps())); ++i) {
        const Glance glance = glanceAt(kLookGlances, kQuickTurns, i / path.fps());
        path.look(eye, path.direction(heading + glance.heading, glance.down));
    }
}

} // namespace gsc
