// SPDX-License-Identifier: Apache-2.0
#include "player/window/rest_comparison.h"

#include <cstring>

namespace gsc {

namespace {

constexpr double kRestSeconds = 0.15; // time without a change after which a pose is compared

std::vector<Image> imagesOf(const DrawnPose& drawn)
{
    std::vector<Image> images;
    for (uint32_t e = 0; e < drawn.asked.eyes; ++e) {
        Image& image = images.emplace_back();
        image.width = drawn.asked.shot.camera.width;
        image.height = drawn.asked.shot.camera.height;
        image.pixels.resize(size_t(image.width) * image.height * 3);
        std::memcpy(image.pixels.data(), drawn.delivery.eyes[e].pixels, image.pixels.size() * sizeof(float));
    }
    return images;
}

} // namespace

void RestComparison::moved(double seconds)
{
    m_state = State::Moving;
    m_rests_since = seconds;
    m_composed.clear();
    if (m_comparison && !m_comparison->complete())
        m_retired.push_back(std::move(m_comparison));
    m_comparison.reset();
}

void RestComparison::advance(double seconds, AskedPose pose, const FrameOptions& options)
{
    if (m_state == State::Compared || m_source.waiting() || seconds - m_rests_since < kRestSeconds)
        return;
    pose.format = PixelFormat::Rgb32f;
    if (m_state == State::Moving)
        m_state = State::Picture;
    m_pose = m_source.submit(pose, m_state == State::Exact ? exactOptions(options) : options);
}

bool RestComparison::take(DrawnPose& drawn)
{
    if (drawn.delivery.pose != m_pose || !underWay())
        return false; // an old picture: the pose has changed since
    if (m_state == State::Picture) {
        m_picture = imagesOf(drawn);
        m_state = State::Exact;
        return false;
    }
    m_comparison = std::make_unique<Comparison>(std::move(m_picture), imagesOf(drawn));
    m_state = State::Compared;
    return true;
}

const std::vector<Picture8>& RestComparison::pictures(CompareMode mode, double share)
{
    if (m_composed.empty())
        for (uint32_t e = 0; e < m_comparison->eyes(); ++e)
            m_composed.push_back(m_comparison->show(e, mode, share));
    return m_composed;
}

void RestComparison::forgetRetired()
{
    std::erase_if(m_retired, [](const auto& comparison) { return comparison->complete(); });
}

} // namespace gsc
