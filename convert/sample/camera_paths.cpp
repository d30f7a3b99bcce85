// SPDX-License-Identifier: Apache-2.0
#include "convert/sample/camera_paths.h"

#include "format/error.h"

#include <algorithm>
#include <cmath>

namespace gsc {

namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr uint32_t kPathSize = 2048; // pixels, square
constexpr double kHeadsetRate = 72;  // frames per second
constexpr double kEyeHeight = 1.6;   // metres
constexpr double kArmLength = 0.7;   // metres

// Adds frames to a path of the site.
class PathMaker {
public:
    PathMaker(const PathSite& site, const char* name, double fps) : m_site(site)
    {
        m_path.name = name;
        m_path.fps = fps;
        m_path.ipd = kEyeDistance * site.metre;
    }

    void look(Vec3 position, Vec3 forward)
    {
        m_path.frames.push_back(lookingAlong(formatString("%s_%04zu", m_path.name.c_str(), m_path.frames.size()),
                                             position, forward, m_site.up, kPathSize, kPathSize, 0.5 * kPi));
    }

    // Unit vector `heading` radians from axis 0 towards axis 1, `down` radians below the horizon.
    [[nodiscard]] Vec3 direction(double heading, double down) const
    {
        const Vec3 level = m_site.axis[0] * std::cos(heading) + m_site.axis[1] * std::sin(heading);
        return level * std::cos(down) - m_site.up * std::sin(down);
    }

    // (0, 0) and (1, 1) are opposite corners of the ground.
    [[nodiscard]] Vec3 above(double u, double v, double height) const
    {
        return m_site.axis[0] * lerp(m_site.low[0], m_site.high[0], u) +
               m_site.axis[1] * lerp(m_site.low[1], m_site.high[1], v) + m_site.up * (m_site.ground + height);
    }

    [[nodiscard]] double side(int axis) const { return m_site.high[axis] - m_site.low[axis]; }
    [[nodiscard]] double diagonalHeading() const { return std::atan2(side(1), side(0)); }
    [[nodiscard]] double eyeHeight() const { return kEyeHeight * m_site.metre; }

    void eyes(double times) { m_path.ipd *= times; }
    CameraPath take() { return std::move(m_path); }

private:
    const PathSite& m_site;
    CameraPath m_path;
};

double degrees(double angle)
{
    return angle * kPi / 180;
}

CameraPath aerial(const PathSite& site)
{
    PathMaker path(site, "aerial", 30);
    const Vec3 forward = path.direction(path.diagonalHeading(), degrees(25));
    for (int i = 0; i < 40; ++i) {
        const double t = 0.25 + 0.5 * i / 39;
        path.look(path.above(t, t, 0.5 * site.view_height), forward);
    }
    return path.take();
}

CameraPath orbit(const PathSite& site)
{
    PathMaker path(site, "orbit", kHeadsetRate);
    for (int i = 0; i < 120; ++i) { // a degree per frame
        const Vec3 forward = path.direction(degrees(i), degrees(35));
        path.look(pathTarget(site) - forward * site.view_height, forward);
    }
    return path.take();
}

CameraPath headTurn(const PathSite& site)
{
    PathMaker path(site, "head_turn", kHeadsetRate);
    const Vec3 eye = path.above(0.5, 0.5, path.eyeHeight());
    for (int i = 0; i < 72; ++i) // still, 180 degrees in 36 steps of 1/72 s, still
        path.look(eye, path.direction(degrees(5.0 * std::clamp(i - 18, 0, 36)), 0));
    return path.take();
}

CameraPath teleport(const PathSite& site)
{
    // where on the ground, how high (0 = eye height, 1 = view height), heading and downward angle in degrees
    static constexpr double kPlaces[8][5] = {
        {0.30, 0.30, 0, 45, 0}, {0.70, 0.60, 0.5, 200, 30}, {0.20, 0.75, 0, 300, 0}, {0.80, 0.20, 1, 135, 50},
        {0.50, 0.50, 0, 0, 0},  {0.25, 0.50, 0.25, 20, 15}, {0.75, 0.80, 0, 225, 0}, {0.40, 0.20, 0.75, 90, 40}};
    PathMaker path(site, "teleport", kHeadsetRate);
    for (const auto& place : kPlaces)
        for (int still = 0; still < 10; ++still)
            path.look(path.above(place[0], place[1], lerp(path.eyeHeight(), site.view_height, place[2])),
                      path.direction(degrees(place[3]), degrees(place[4])));
    return path.take();
}

CameraPath zoomOut(const PathSite& site)
{
    PathMaker path(site, "zoom_out", kHeadsetRate);
    const double first = 0.25 * site.view_height;
    const double last = std::max(4 * site.view_height, std::hypot(path.side(0), path.side(1)));
    const Vec3 forward = path.direction(path.diagonalHeading(), degrees(50));
    for (int i = 0; i < 100; ++i) // the same factor each frame
        path.look(pathTarget(site) - forward * (first * std::pow(last / first, i / 99.0)), forward);
    return path.take();
}

CameraPath walkThrough(const PathSite& site)
{
    PathMaker path(site, "walk_through", kHeadsetRate);
    // off the axes, so that a street along one of them does not lead past everything
    const double heading = 0.6 * path.diagonalHeading();
    const double way =
        std::min(30 * site.metre, 0.8 * std::min(path.side(0) / std::cos(heading), path.side(1) / std::sin(heading)));
    const Vec3 forward = path.direction(heading, 0), middle = path.above(0.5, 0.5, path.eyeHeight());
    for (int i = 0; i < 120; ++i)
        path.look(middle + forward * (way * (i / 119.0 - 0.5)), forward);
    return path.take();
}

CameraPath levelSwing(const PathSite& site)
{
    PathMaker path(site, "level_swing", kHeadsetRate);
    const double boundary = levelBoundary(site, site.view_height);
    const Vec3 forward = path.direction(path.diagonalHeading(), degrees(40));
    for (int i = 0; i < 96; ++i) // four swings of 10 % to either side, no frame on the boundary itself
        path.look(pathTarget(site) - forward * (boundary * (1 + 0.1 * std::sin(2 * kPi * (i + 0.5) / 24))), forward);
    return path.take();
}

CameraPath jitter(const PathSite& site)
{
    PathMaker path(site, "jitter", kHeadsetRate);
    const Vec3 forward = path.direction(path.diagonalHeading(), degrees(45));
    const Vec3 target = pathTarget(site);
    const Vec3 axes[3] = {site.axis[0], site.axis[1], site.up};
    for (int i = 0; i < 120; ++i) {
        // grows from 1 mm to 2 cm; the three rates share no period
        const double reach = 0.001 * std::pow(20.0, i / 119.0) * site.metre;
        Vec3 eye = target - forward * (kArmLength * site.metre);
        for (int axis = 0; axis < 3; ++axis)
            eye = eye + axes[axis] * (reach * std::sin(i * (1.1 + 0.37 * axis) + axis));
        path.look(eye, normalized(target - eye));
    }
    return path.take();
}

CameraPath wideEyes(const PathSite& site)
{
    PathMaker path(site, "wide_eyes", kHeadsetRate);
    path.eyes(20);
    const double heading = path.diagonalHeading();
    const Vec3 forward = path.direction(heading, degrees(5)), step = path.direction(heading, 0);
    for (int i = 0; i < 60; ++i) // walks 1.4 metres per second
        path.look(path.above(0.5, 0.5, path.eyeHeight()) + step * (1.4 * site.metre * i / kHeadsetRate), forward);
    return path.take();
}

} // namespace

Vec3 pathTarget(const PathSite& site)
{
    return site.axis[0] * (0.5 * (site.low[0] + site.high[0])) + site.axis[1] * (0.5 * (site.low[1] + site.high[1])) +
           site.up * site.ground;
}

double levelBoundary(const PathSite& site, double near_to)
{
    if (site.level_rule == LevelRule::None || !(site.standard_dist > 0) || site.finest_level < 1 || site.fork < 2)
        return near_to;
    // log(standard_dist / distance) at which level 0 gives way to level 1
    const double first = site.level_rule == LevelRule::Floor ? 1 : site.level_rule == LevelRule::Round ? 0.5 : 0;
    const double wanted = std::log(site.standard_dist / near_to) / std::log(double(site.fork));
    const double k = std::clamp(std::round(wanted - first), 0.0, double(site.finest_level - 1));
    return site.standard_dist * std::pow(double(site.fork), -(first + k));
}

std::vector<CameraPath> cameraPaths(const PathSite& site)
{
    return {aerial(site),      orbit(site),      headTurn(site), teleport(site), zoomOut(site),
            walkThrough(site), levelSwing(site), jitter(site),   wideEyes(site)};
}

std::string writeCameraPaths(const ModelFolder& folder, const std::vector<CameraPath>& paths)
{
    for (const CameraPath& path : paths)
        writeFile(folder.file("paths/" + path.name + ".json"),
                  trajectoryJson(path.name, path.frames, path.fps, path.ipd));
    return "paths/aerial.json";
}

} // namespace gsc
