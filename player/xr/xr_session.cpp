// SPDX-License-Identifier: Apache-2.0
#include "player/xr/xr_session.h"

#include <gsc/error.h>
#include "runtime/cli/setting_words.h"
#include <gsc/interrupt.h>
#include "kernels/threads/stopwatch.h"
#include "runtime/cameras/length.h"
#include "player/frames/lod_target.h"
#include "player/xr/place_file.h"

#include <algorithm>
#include <cmath>
#include <thread>

namespace gsc {

namespace {

constexpr auto kIdle = std::chrono::milliseconds(10);
constexpr auto kStartWait = std::chrono::seconds(5); // longest time for measuring the start
constexpr double kLagShare = 0.1;                    // weight of the newest picture in the running mean m_lag
constexpr double kMostLag = 3; // largest m_lag in refreshes; a pose predicted further ahead is a guess

std::vector<Shot> shotsOf(const Scene& scene, const PlayOptions& play, Reporter& log)
{
    checkLevelOptions(scene, play.model.file, play.frame);
    // size of the cameras in pixels; only their places matter, since lens and size are the headset's
    constexpr uint32_t kSide = 16;
    return chooseShots(scene, play.model.file, play.cameras, {kSide, kSide, play.view.fov_x, 1, {}}, log);
}

double metreOf(const Scene& scene, const XrOptions& options)
{
    if (options.metre > 0)
        return options.metre;
    const std::optional<Metre> metre = metreOfManifest(scene.manifest());
    if (!metre)
        throw Error(ErrorCode::Usage, options.play.model.file, "does not say how long a metre is",
                    "that for a headset, whose viewer has a size", "pass --metre with its world units");
    return metre->units;
}

std::array<double, 3> upOf(const std::vector<Shot>& shots)
{
    return shots.front().up;
}

SpacePose headOf(const std::vector<SpaceEye>& eyes)
{
    SpacePose head = eyes.front().pose;
    if (eyes.size() > 1) { // the eyes of a headset may look in slightly different directions
        head.position = (head.position + eyes[1].pose.position) / 2.0;
        head.rotation = glm::slerp(head.rotation, eyes[1].pose.rotation, 0.5);
    }
    return head;
}

// Moves the placement up by `higher` metres.
Placement raised(const Placement& place, double higher)
{
    return {place.toWorld({0, higher, 0}), place.axes(), place.scale()};
}

int64_t refreshes(int64_t time, int64_t period)
{
    return period > 0 ? std::llround(double(time) / double(period)) : 0;
}

// Time from when the renderer began the first pair of views until the last was drawn.
double beganToThere(const DrawnViews& drawn)
{
    ServiceTime begun = drawn.pairs.front().delivery.begun, there = begun;
    for (const DrawnPose& pair : drawn.pairs) {
        begun = std::min(begun, pair.delivery.begun);
        there = std::max(there, pair.delivery.drawn);
    }
    return milliseconds(there - begun);
}

} // namespace

XrSession::XrSession(const XrOptions& options, std::shared_ptr<const Scene> scene, Headset& headset, Reporter& log)
    : m_options(options), m_scene(std::move(scene)), m_headset(headset), m_report(log),
      m_shots(shotsOf(*m_scene, options.play, log)), m_metre(metreOf(*m_scene, options)),
      m_floor(eyeHeight() - kEyeHeight), m_place(m_shots.front().camera, upOf(m_shots), m_metre, eyeHeight()),
      m_hands(m_place, m_floor), m_frame_options(frameOptions(*m_scene, options.play.frame)), m_lenses(headset, log),
      m_source(m_scene, options.play.model, options.play.devices, headset, options.waits, headset.facts().views.size(),
               log)
{
    if (options.rides) {
        std::vector<Camera> cameras;
        for (const Shot& shot : m_shots)
            cameras.push_back(shot.camera);
        m_ride.emplace(std::move(cameras), options.ride_fps, upOf(m_shots), m_metre, eyeHeight());
    } else {
        start();
    }
    m_guard = checkedGuard(*m_scene, options.play.model.file, options.play.frame,
                           {m_source.drawsDetail(options.play.frame), true});
    if (options.late)
        m_late = std::make_shared<LateEyes>(headset, options.waits);
    m_headset.prepare();
    m_log = std::make_unique<XrLog>(options.log,
                                    // opened last, so that an earlier error does not replace an old file
                                    options.play.output.overwrite);
}

XrSession::~XrSession()
{
    if (m_late) // m_late must fail from now on: a renderer that hangs may call it after the session has ended
        m_late->stop();
}

void XrSession::start()
{
    const std::optional<Placement> kept = m_options.keeps_place ? readPlace(m_options.play.model.file) : std::nullopt;
    const Start start = chooseStart(m_options.start, m_scene->view(), m_shots.front(), upOf(m_shots), m_metre,
                                    [this](const Shot& shot, uint32_t eyes) { return drawDepths(shot, eyes); });
    if (m_options.start == StartPlace::Ground && start.place != StartPlace::Ground)
        m_report.warning("--start ground: no ground was found in the middle of the first camera's picture; the viewer "
                         "starts at the camera");
    std::string text = startText(start);
    if (m_options.start == StartPlace::Most && !start.shown[size_t(StartPlace::Table)]) // the last one to be measured
        text += formatString("; not all starts were drawn in %lld s, --start chooses one",
                             static_cast<long long>(kStartWait.count()));
    m_report.tell(kept ? formatString("starts where the viewer was left; the menu button goes back to the start, %s",
                                      startWords(start.place))
                       : text);
    m_place = raised(start.eyes, -eyeHeight());
    m_hands = Hands(m_place, m_floor);
    if (kept)
        m_place =
            raised({kept->origin(), kept->axes(), m_options.metre > 0 ? m_options.metre : kept->scale()}, -eyeHeight());
}

// Draws before the session's first frame. Empty if no picture comes in time: a device may hang or be slow.
EyeDepths XrSession::drawDepths(const Shot& shot, uint32_t eyes)
{
    FrameOptions options = m_frame_options;
    options.detail = options.foveation.smallest = 0; // without what later frames would find kept from this one
    options.reuse = {};
    AskedViews views; // its frame is 0, which is never shown
    AskedPose& pose = views.pairs.emplace_back();
    pose.shot = shot;
    pose.eyes = eyes;
    pose.wants_depth = true;
    EyeDepths depths;
    for (bool asked = false; !interrupted() && Clock::now() - m_start < kStartWait;) {
        asked = (asked && m_source.waiting()) || m_source.submit(views, options);
        const std::optional<DrawnViews> drawn = m_source.next(std::chrono::milliseconds(100));
        if (!drawn)
            continue;
        for (uint32_t e = 0; e < eyes; ++e) {
            const float* const from = drawn->pairs.front().delivery.eyes[e].depth;
            depths[e].assign(from, from + size_t(shot.camera.width) * shot.camera.height);
        }
        break;
    }
    return depths;
}

void XrSession::requestExit()
{
    if (!m_exits)
        m_headset.requestExit();
    m_exits = true;
}

bool XrSession::step()
{
    const HeadsetState state = m_headset.poll();
    if (m_options.seconds > 0 && milliseconds(Clock::now() - m_start) >= 1000 * m_options.seconds &&
        state == HeadsetState::Idle)
        requestExit();
    if (m_headset.spaceMoved())
        forgetPictures();
    switch (state) {
    case HeadsetState::Over:
        return false;
    case HeadsetState::Lost:
        throw Error(ErrorCode::Device, "headset", "the OpenXR runtime or the headset has gone", "that they stay",
                    "start the runtime and the player again");
    case HeadsetState::Idle: // a picture may still be finished, but is not shown
        forgetPictures();
        m_last_time = 0;
        std::this_thread::sleep_for(kIdle);
        return true;
    case HeadsetState::Running:
        break;
    }
    frame();
    return true;
}

// Takes one frame of the headset and always ends it. Waits for pictures only if the options ask for that.
void XrSession::frame()
{
    const HeadsetFrame frame = m_headset.beginFrame();
    const Clock::time_point woken = Clock::now();
    XrFrame line;
    line.frame = ++m_frame;
    line.display_time = frame.display_time;
    line.period_ms = double(frame.period) / 1e6;
    line.visible = frame.visible;
    if (m_late)
        m_late->woke(woken, frame);
    if (m_first_time == 0)
        m_first_time = frame.display_time;
    const double seconds = double(frame.display_time - m_first_time) / 1e9;
    if (m_last_time != 0)
        line.missed = uint64_t(std::max(refreshes(frame.display_time - m_last_time, frame.period) - 1, int64_t(0)));
    if (frame.visible) {
        ask(frame, line);
        take(line);
        if (m_moved) {
            line.moved = m_place;
            m_moved = false;
        }
    } else {
        forgetPictures();
    }
    m_headset.endFrame(frame.visible && !m_stale);
    line.busy_ms = milliseconds(Clock::now() - woken);
    line.copy_ms = m_headset.copyMs();
    if (frame.visible && !m_stale) {
        const AskedViews& asked = m_shown.back().asked;
        line.shows = asked.frame;
        line.age = uint64_t(refreshes(frame.display_time - asked.shown_at, frame.period));
        line.off_ms = double(frame.display_time - asked.time) / 1e6;
    }
    try {
        m_log->add(line);
    } catch (const Error& e) { // a full disk does not end the session; the log keeps the lines so far
        m_report.warning(warningText(e));
        m_log->close();
    }
    m_last_time = frame.display_time;
    if (m_options.seconds > 0 && seconds >= m_options.seconds)
        requestExit();
}

void XrSession::move(const HeadsetFrame& frame, const HeadsetInput& input)
{
    if (m_ride) {
        m_place = m_ride->at(double(frame.display_time - m_first_time) / 1e9);
        m_moved = true;
        return;
    }
    const double seconds = m_last_time == 0 ? 0 : double(frame.display_time - m_last_time) / 1e9;
    m_moved = m_hands.step(m_place, input, headOf(m_eyes), seconds) || m_moved;
}

// Locates the eyes and submits them. They are predicted for the time at which their picture will be displayed: m_lag
// refreshes later than this frame.
void XrSession::ask(const HeadsetFrame& frame, XrFrame& line)
{
    const auto ahead = m_options.waits ? 0 : int64_t(std::lround(m_lag)) * frame.period;
    const int64_t time = frame.display_time + ahead;
    line.tracked = m_headset.locate(time, m_eyes);
    if (m_eyes.empty())
        return;
    const HeadsetInput input = m_headset.input(frame.display_time);
    move(frame, input);
    if (!line.tracked)
        return; // the headset is not tracked: the picture drawn last is shown again, where it was
    if (!m_source.renewing())
        m_lenses.follow(m_eyes);
    if (m_guard)
        m_guard->applyTo(m_frame_options);
    const bool gazes = m_options.play.frame.foveation == FoveationMode::Gaze && input.gaze;
    AskedViews views;
    views.frame = m_frame;
    views.shown_at = frame.display_time;
    views.time = time;
    views.eyes = m_eyes;
    requestViews(views, m_shots.front(), m_place, m_headset.facts(), m_lenses, gazes ? &*input.gaze : nullptr, m_late);
    (void)m_source.submit(std::move(views), m_frame_options);
}

void XrSession::take(XrFrame& line)
{
    std::optional<DrawnViews> drawn = m_source.next(std::chrono::nanoseconds(0));
    while (m_options.waits && !drawn && m_source.waiting()) {
        if (interrupted())
            return; // interrupted: the caller ends the frame, and then the session
        drawn = m_source.next(std::chrono::milliseconds(100));
    }
    if (!drawn || drawn->asked.frame < m_valid_from)
        return;
    if (const LateLook* const look = drawn->asked.late.get(); look != nullptr && look->found) {
        drawn->asked.eyes = look->eyes;
        drawn->asked.time = look->time;
    }
    m_headset.finish(); // waits until the last pictures are read, because their memory is used again
    const std::vector<ShownPicture> pictures = m_source.shown(*drawn);
    if (pictures.size() != drawn->asked.eyes.size())
        return; // a picture is missing because the headset's GPU is lost
    m_headset.take({pictures, drawn->asked.eyes, drawn->asked.metre});
    line.fresh = true;
    m_stale = false;
    for (const DrawnPose& pair : drawn->pairs) {
        line.latency_ms = std::max(line.latency_ms, pair.latencyMs());
        line.draw_ms += pair.delivery.result.times.total;
        line.anchors_absent = std::max(line.anchors_absent, pair.delivery.result.anchors_absent);
    }
    if (m_late)
        m_late->drew(beganToThere(*drawn));
    const AskedPose& asked = drawn->pairs.front().asked;
    line.lod_bias = double(asked.lod_bias);
    line.detail = double(asked.detail);
    line.fovea_pixels = double(asked.fovea_pixels);
    line.gaze = drawn->asked.gaze;
    if (m_guard)
        m_guard->add(line.draw_ms);
    const auto lag = double(refreshes(line.display_time - drawn->asked.shown_at, int64_t(line.period_ms * 1e6)));
    m_lag = std::min(m_lag + kLagShare * (lag - m_lag), kMostLag);
    m_shown.push_back(std::move(*drawn));
    while (m_shown.size() > 2)
        m_shown.pop_front();
}

XrSummary XrSession::finish()
{
    XrSummary summary;
    summary.file = m_options.play.model.file;
    summary.headset = m_headset.facts();
    m_lenses.tell(summary.headset);
    summary.seconds = milliseconds(Clock::now() - m_start) / 1000;
    m_log->sumUp(summary);
    summary.renewals = m_source.renewals();
    summary.service = m_source.stats();
    if (m_options.keeps_place)
        summary.place = keepPlace();
    return summary;
}

// stores the place of the eyes, not of the floor: the next session may have another floor
std::string XrSession::keepPlace() const
{
    return writePlace(m_options.play.model.file, raised(m_place, eyeHeight()));
}

void XrSession::forgetPictures()
{
    m_stale = true;
    m_valid_from = m_frame + 1;
    m_hands.letGo();
}

} // namespace gsc
