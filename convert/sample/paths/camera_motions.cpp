// SPDX-License-Identifier: Apache-2.0
#include "convert/sample/paths/camera_motions.h"

#include "convert/survey/camera_view.h"
#include <gsc/error.h>

#include <algorithm>
#include <cmath>

namespace gsc {

dvec3 radialDirection(const PathSite& site, double heading, double down)
{
    const dvec3 level = site.axis[0] * std::cos(heading) + site.axis[1] * std::sin(heading);
    return level * std::cos(down) - site.up * std::sin(down);
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
        // the three rates share no period
        const double reach = 0.001 * std::pow(20.0, i / double(frames - 1)) * site.metre;
        dvec3 eye = target - forward * distance;
        for (int axis = 0; axis < 3; ++axis)
            eye = eye + axes[axis] * (reach * std::sin(i * (rate + spread * axis) + axis));
        path.look(eye, normalized(target - eye));
    }
}

} // namespace gsc
