// SPDX-License-Identifier: Apache-2.0
// Submits the window's view: position of the camera, lens and settings.
#include "player/window/window_session.h"

#include <gsc/error.h>
#include "runtime/records/reuse_names.h"
#include <gsc/frame_stats.h>

#include <algorithm>
#include <cmath>

namespace gsc {

namespace {

constexpr uint32_t kMeasuredPixels = 16; // side of the part of the view whose depth is measured
constexpr double kMeasureSeconds = 0.25; // least time between two measurements

// Compares with a small tolerance: a camera at the limit of its pitch still changes by rounding, and needs no new
// picture.
bool isNear(double a, double b)
{
    return std::abs(a - b) <= 1e-12 * (1 + std::abs(b));
}

} // namespace

bool WindowSession::View::operator==(const View& other) const
{
    const Camera &a = camera, &b = other.camera;
    return width == other.width && height == other.height && std::ranges::equal(a.rotation, b.rotation, isNear) &&
           std::ranges::equal(a.translation, b.translation, isNear) && a.fov_x == b.fov_x && a.fov_y == b.fov_y &&
           a.appearance == b.appearance;
}

double WindowSession::fittedTangent(uint32_t width, uint32_t height) const
{
    return std::max(m_tan_y, m_tan_x * height / width);
}

uint32_t WindowSession::eyeWidth() const
{
    return m_settings.two_eyes ? std::max(m_input.width / 2, 1u) : m_input.width;
}

Camera WindowSession::lens(uint32_t width, uint32_t height) const
{
    Camera lens = m_shots[size_t(m_camera)].camera;
    lens.width = width;
    lens.height = height;
    lens.appearance = m_shots[size_t(m_camera)].appearance;
    lens.tan_mid_x = lens.tan_mid_y = 0;
    lens.fov_x = lens.fov_y = 0;
    // set by a focal length in pixels, as a camera file states it, so that the camera file of a screenshot gives the
    // same lens
    lens.focal_x = lens.focal_y = height / (2 * fittedTangent(width, height));
    finishCamera(lens, width, height, 0);
    return lens;
}

WindowSession::View WindowSession::view() const
{
    View view;
    view.width = m_input.width;
    view.height = m_input.height;
    view.camera = m_navigator.camera(lens(eyeWidth(), m_input.height));
    return view;
}

AskedPose WindowSession::pose(const View& view) const
{
    AskedPose pose;
    pose.shot = m_shots[size_t(m_camera)]; // the shot of the camera that was jumped to last gives appearance and origin
    pose.shot.camera = view.camera;
    pose.shot.right_eye.reset();
    pose.shot.ipd = m_settings.two_eyes ? m_ipd : 0;
    pose.eyes = m_settings.two_eyes ? 2 : 1;
    return pose;
}

// Returns true if the depth ahead is to be measured, for the speed of Fly. It costs a small part of a frame; with
// reuse, and with detail at rest, it would change what is kept from frame to frame.
bool WindowSession::measures(const View& wanted) const
{
    const FrameChoice& choice = m_settings.choice;
    return m_navigator.mode() == NavigationMode::Fly && !(wanted == m_measured) &&
           now() - m_measured_at >= kMeasureSeconds && choice.reuse.policy == ReusePolicy::None &&
           (choice.detailPixels() == 0 || m_controls.moving());
}

// Submits the middle of the view alone, as large as it is there, so that levels and detail are those of the view.
void WindowSession::seekDepth(const View& wanted)
{
    m_seeks = false;
    m_seeking = true;
    m_measured = wanted;
    m_measured_at = now();
    m_changed = m_changed || m_source.waiting(); // a pose that waits to be drawn gives way
    View middle = wanted;
    Camera& camera = middle.camera;
    const uint32_t width = std::min(camera.width, kMeasuredPixels), height = std::min(camera.height, kMeasuredPixels);
    camera.fov_x = 2 * std::atan(std::tan(camera.fov_x / 2) * width / camera.width);
    camera.fov_y = 2 * std::atan(std::tan(camera.fov_y / 2) * height / camera.height);
    camera.width = width;
    camera.height = height;
    AskedPose seeks = pose(middle);
    seeks.wants_depth = true;
    (void)m_source.submit(seeks, frameOptionsNow());
}

FrameOptions WindowSession::frameOptionsNow() const
{
    FrameOptions frame = gsc::frameOptions(*m_scene, m_settings.choice);
    std::copy_n(m_settings.background, 3, frame.background);
    frame.view = m_settings.view;
    if (m_guard)
        m_guard->applyTo(frame);
    return frame;
}

// Tells the guard the time of a frame. If the guard then changes the settings, the view is drawn again, even at rest:
// the change may give detail back.
void WindowSession::hold(double frame_ms)
{
    if (!m_guard || m_loading)
        return;
    const FrameOptions before = frameOptionsNow();
    m_guard->add(frame_ms);
    const FrameOptions after = frameOptionsNow();
    m_changed = m_changed || before.detail != after.detail || before.lod_bias != after.lod_bias ||
                before.foveation.smallest != after.foveation.smallest;
}

Guarded WindowSession::guarded(const FrameChoice& choice) const
{
    return {m_source.drawsDetail(choice), choice.tier != Tier::Exact};
}

std::string WindowSession::whyNot(const FrameChoice& choice) const
{
    if (choice.detail > 0 && choice.reuse.policy != ReusePolicy::None)
        return formatString(
            "detail %g: together with reuse %s, expected one of them, because both keep what was decoded; "
            "switch the other off",
            choice.detail, policyName(choice.reuse.policy));
    if (choice.detail > m_settings.choice.detail && choice.tier == Tier::Exact)
        return formatString("detail %g: in the tier exact, expected fast, because exact draws everything by itself; "
                            "switch the tier",
                            choice.detail);
    return {};
}

std::string WindowSession::settingsText() const
{
    const FrameChoice& choice = m_settings.choice;
    std::string text = formatString("%s, reuse %s", tierName(choice.tier), policyName(choice.reuse.policy));
    if (choice.reuse.policy == ReusePolicy::Error)
        text += formatString(" %g/255", double(choice.reuse.bound));
    if (choice.detailPixels() > 0)
        text += formatString(", detail %g", choice.detail);
    if (choice.lod_bias != 0)
        text += formatString(", level bias %g", choice.lod_bias);
    if (choice.lod_fade != 0)
        text += formatString(", level fade %g", choice.lod_fade);
    constexpr const char* kViews[] = {"", ", colours: level", ", colours: age", ", colours: cost", ", colours: detail"};
    return text + kViews[size_t(m_settings.view)];
}

} // namespace gsc
