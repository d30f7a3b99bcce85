// SPDX-License-Identifier: Apache-2.0
#include "player/xr/ride.h"

#include "player/poses/pose.h"

#include <algorithm>
#include <cmath>

namespace gsc {

Ride::Ride(std::vector<Camera> cameras, double fps, const std::array<double, 3>& up, double metre, double eye_height)
    : m_cameras(std::move(cameras)), m_fps(fps), m_up(up), m_metre(metre), m_eye_height(eye_height)
{
}

Placement Ride::at(double seconds) const
{
    const double frame = std::clamp(seconds * m_fps, 0.0, double(m_cameras.size() - 1));
    const auto first = size_t(frame), next = std::min(first + 1, m_cameras.size() - 1);
    Camera camera = m_cameras[first];
    const std::optional<CameraPose> from = poseOf(camera), to = poseOf(m_cameras[next]);
    if (from && to && next != first)
        setPose(between(*from, *to, frame - double(first)), camera);
    return {camera, m_up, m_metre, m_eye_height};
}

} // namespace gsc
