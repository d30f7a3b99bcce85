// SPDX-License-Identifier: Apache-2.0
#include "player/window/window_session.h"

#include <gsc/error.h>
#include <gsc/file/output_paths.h>
#include "runtime/cli/setting_words.h"
#include "runtime/cameras/length.h"
#include "player/devices/open_renderer.h"
#include "player/devices/worker_options.h"
#include "runtime/records/reuse_names.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <utility>

namespace gsc {

namespace {

constexpr double kIdleSeconds = 0.1; // longest wait for input while nothing moves
constexpr double kPadSeconds = 0.01; // longest wait while a gamepad is connected, because its input does not end a wait
// wait for input while a key is held or a picture is being drawn, if the last turn of the loop had nothing to do
constexpr double kTurnSeconds = 0.004;
constexpr int kAttempts = 3; // tries to draw a picture that fails, before the next pose is tried
// longest wait for a picture, before the window's input is read again
constexpr auto kPictureWait = std::chrono::milliseconds(12);
constexpr double kMessageSeconds = 4;
constexpr double kCameraSeconds = 1;  // time of a flight from one camera to the next
constexpr double kSettingStep = 0.25; // step of a level setting by key, in levels
constexpr double kPace = 0.5;         // Fly's default speed, distances to what is ahead per second
constexpr double kPaceSeconds = 0.3;  // time in which the speed follows a change of that distance, but for a third
constexpr double kSplitStep = 0.02;   // step of the dividing line by key, share of the width

NavigationWorld worldOf(const Scene& scene, const std::vector<Shot>& shots)
{
    NavigationWorld world;
    std::ranges::copy(shots.front().up, world.up);
    if (const std::optional<Metre> metre = metreOfManifest(scene.manifest()))
        world.metre = metre->units;
    const ModelView& view = scene.view();
    for (int i = 0; i < 3; ++i) {
        world.low[i] = double(view.params->bounds_min[i]) + view.origin[i];
        world.high[i] = double(view.params->bounds_max[i]) + view.origin[i];
    }
    return world;
}

template <typename Names, typename Value>
Value nextOf(const Names& names, Value value)
{
    for (size_t i = 0; i < names.size(); ++i)
        if (names[i].second == value)
            return names[(i + 1) % names.size()].second;
    return value;
}

// Returns the cameras of the options as shots in their own size, for one or two eyes; a camera without a size gets the
// window's.
std::vector<Shot> shotsOf(const Scene& scene, const PlayOptions& play, int eyes, const Length& ipd, Reporter& log)
{
    const ViewChoice view{play.view.width, play.view.height, play.view.fov_x, eyes, ipd, true};
    return chooseShots(scene, play.model.file, play.cameras, view, log);
}

} // namespace

WindowSession::WindowSession(const WindowModel& model, Presenter& presenter, WindowHistory history, Reporter& log)
    : m_options(model.options), m_scene(model.scene), m_presenter(presenter), m_report(log),
      m_source(m_scene, m_options.play.model, m_options.play.devices, presenter,
               openService(
                   m_scene, m_options.play.model, m_options.play.devices, [](ServiceOptions&) {}, log)),
      m_shots(shotsOf(*m_scene, m_options.play, 1, {}, log)), m_navigator(worldOf(*m_scene, m_shots)),
      m_history(std::move(history))
{
    const WindowOptions& options = m_options;
    ViewLimits limits;
    limits.has_levels = m_scene->view().params->level_count > 1;
    try {
        // drops messages: this only tries whether two eyes are possible
        Reporter silent({ReportFormat::Text, ProgressMode::None, true});
        m_ipd = shotsOf(*m_scene, options.play, 2, options.play.view.ipd, options.play.view.eyes == 2 ? log : silent)
                    .front()
                    .ipd;
    } catch (const Error& e) {
        if (options.play.view.eyes == 2)
            throw;
        limits.no_stereo = warningText(e);
    }
    if (m_ipd == 0 && limits.no_stereo.empty()) {
        limits.no_stereo = "the cameras say where each eye of theirs is, not how far eyes are apart";
        if (options.play.view.eyes == 2)
            throw Error(ErrorCode::Usage, options.play.cameras.file, "says where each eye is",
                        "how far they are apart, for the window moves both",
                        "pass other cameras, or leave out --eyes 2");
    }
    m_no_stereo = limits.no_stereo;

    m_settings.choice = options.play.frame;
    m_settings.two_eyes = options.play.view.eyes == 2;
    std::copy_n(gsc::frameOptions(*m_scene, options.play.frame).background, 3, m_settings.background);
    m_worked = m_settings;
    m_guard = checkedGuard(*m_scene, options.play.model.file, m_settings.choice, guarded(m_settings.choice));
    std::vector<std::string> names;
    for (const Shot& shot : m_shots)
        names.push_back(shot.camera.name);
    m_panel = std::make_unique<Panel>(limits, std::move(names), m_overlay);
    m_overlay.keys = helpLines();
    jump(0, false);
    say("F1: keys");
    if (m_history.log)
        return;
    std::error_code code;
    std::filesystem::create_directories(options.folder, code);
    if (code)
        failOutput(options.folder, "cannot be made", code.value());
    // opened last, so that an earlier error does not replace an old file
    m_history.log = std::make_unique<JsonLines>(options.log, options.play.output.overwrite);
}

bool WindowSession::idle() const
{
    const bool asks = (m_changed || m_again || m_seeks) && hasSize();
    const bool compares = m_settings.compare != CompareMode::Off && m_comparison.underWay() && !m_changed && !m_again;
    return !m_dirty && !asks && !m_controls.moving() && !m_navigator.moves() && !m_plays && !m_source.waiting() &&
           !compares;
}

bool WindowSession::step()
{
    const bool rested = idle();
    m_input = m_presenter.poll(rested               ? (m_input.gamepad.present ? kPadSeconds : kIdleSeconds)
                               : m_worked_last_turn ? 0
                                                    : kTurnSeconds);
    m_worked_last_turn = false;
    m_rested = m_rested || rested;
    if (rested)
        m_last_step = now(); // nothing moved while the loop rested, so a key pressed just now counts from now
    // at most 0.25 s, so that the camera does not leap after the window hung
    const double at = now(), seconds = std::min(at - m_last_step, 0.25);
    m_last_step = at;
    for (const Action action : m_controls.take(m_input))
        act(action);
    m_keys.insert(m_keys.end(), m_controls.pressed().begin(), m_controls.pressed().end());
    const bool message_ends = !m_overlay.message.empty() && at > m_message_ends;
    const bool panel_ages = m_overlay.panel && at - m_last_show >= kIdleSeconds;
    m_dirty = m_dirty || m_input.exposed || !m_input.events.empty() || message_ends || panel_ages;
    if (!m_input.dropped.empty())
        openDropped(m_input.dropped.front());
    if (m_input.closed || m_closes || m_next || (m_options.seconds > 0 && at >= m_options.seconds))
        return false;
    takePanel();
    move(seconds);
    if (hasSize())
        ask();
    takePicture();
    compareAtRest();
    m_comparison.forgetRetired();
    if (m_dirty) {
        m_worked_last_turn = true;
        show(m_input);
    }
    return true;
}

void WindowSession::act(Action action)
{
    ViewSettings settings = m_settings;
    switch (action) {
    case Action::Help:
        m_overlay.help = !m_overlay.help;
        break;
    case Action::Panel:
        m_overlay.panel = !m_overlay.panel;
        break;
    case Action::PanelKeys:
        m_overlay.panel = m_overlay.takes_keys = true;
        break;
    case Action::FullScreen:
        m_presenter.toggleFullScreen();
        break;
    case Action::Escape:
        m_overlay.help = m_overlay.panel = false;
        break;
    case Action::Close:
        m_closes = true;
        break;
    case Action::Screenshot:
        wantScreenshot();
        break;
    case Action::Record:
        toggleRecording();
        break;
    case Action::NextCamera:
    case Action::PreviousCamera: {
        const int count = int(m_shots.size());
        jump((m_camera + (action == Action::NextCamera ? 1 : count - 1)) % count, true);
        break;
    }
    case Action::FirstCamera:
        jump(0, false);
        break;
    case Action::PlayCameras:
        m_plays = !m_plays;
        break;
    case Action::Fly:
        setMode(NavigationMode::Fly);
        break;
    case Action::Orbit:
        setMode(NavigationMode::Orbit);
        break;
    case Action::Walk:
        setMode(NavigationMode::Walk);
        break;
    case Action::LevelOut:
        m_navigator.level();
        break;
    case Action::NextTier:
        settings.choice.tier = nextOf(tiers(), settings.choice.tier);
        break;
    case Action::NextReuse:
        do {
            settings.choice.reuse.policy = nextOf(reusePolicies(), settings.choice.reuse.policy);
        } while (settings.choice.reuse.policy == ReusePolicy::Error &&
                 (drawsOnGpu(m_options.play.devices) ||
                  // no renderer takes reuse policy `error` together with merged eyes
                  (settings.two_eyes && settings.choice.stereo == StereoMode::Merged)));
        break;
    case Action::NextDetail: {
        const auto next = std::ranges::find_if(
            kDetails, [&](const auto& detail) { return detail.second > m_settings.choice.detail; });
        settings.choice.detail = next == kDetails.end() ? 0 : next->second;
        break;
    }
    case Action::NextView:
        settings.view = FrameView((uint32_t(settings.view) + 1) % kFrameViews);
        break;
    case Action::Stereo:
        settings.two_eyes = !settings.two_eyes && m_ipd > 0;
        if (m_ipd == 0)
            say(m_no_stereo);
        break;
    case Action::LessDetail:
    case Action::MoreDetail:
        if (m_scene->view().params->level_count > 1)
            settings.choice.lod_bias =
                std::clamp(settings.choice.lod_bias + (action == Action::MoreDetail ? kSettingStep : -kSettingStep),
                           -double(kMaxLodBias), double(kMaxLodBias));
        else
            say("level bias: the model has one level");
        break;
    case Action::Compare:
        settings.compare = CompareMode((int(settings.compare) + 1) % 3);
        break;
    case Action::SplitLeft:
        settings.split = std::max(0.0, settings.split - kSplitStep);
        break;
    case Action::SplitRight:
        settings.split = std::min(1.0, settings.split + kSplitStep);
        break;
    }
    changeSettings(settings);
    m_dirty = true;
}

void WindowSession::takePanel()
{
    ViewSettings settings = m_settings;
    int camera = -1, mode = -1;
    bool screenshot = false, record = false;
    if (!m_overlay.panel || !m_panel->take(settings, camera, mode, screenshot, record))
        return;
    if (camera >= 0)
        jump(camera, false);
    if (mode >= 0)
        setMode(NavigationMode(mode));
    if (screenshot)
        wantScreenshot();
    if (record)
        toggleRecording();
    changeSettings(settings);
}

// Takes changed settings. A change of how a comparison is shown needs no new picture; every other change does.
void WindowSession::changeSettings(const ViewSettings& settings)
{
    if (const std::string why = whyNot(settings.choice); !why.empty())
        return say(why);
    const ViewSettings before = m_settings;
    m_settings = settings;
    const FrameChoice &a = before.choice, &b = settings.choice;
    const bool picture = a.tier != b.tier || a.reuse.policy != b.reuse.policy || a.reuse.bound != b.reuse.bound ||
                         a.detail != b.detail || a.lod_bias != b.lod_bias || a.lod_fade != b.lod_fade ||
                         before.two_eyes != settings.two_eyes || before.view != settings.view ||
                         !std::equal(before.background, before.background + 3, settings.background);
    m_changed = m_changed || picture;
    if (picture) {
        m_guard = frameGuard(*m_scene, b, guarded(b));
        say(settingsText());
    }
    if (before.compare != settings.compare || before.split != settings.split) {
        m_comparison.showOtherwise();
        m_dirty = true;
    }
}

// Switches the mode. Orbit turns about the point in the middle of the view, so its depth is asked for once.
void WindowSession::setMode(NavigationMode mode)
{
    m_seeks = mode == NavigationMode::Orbit;
    m_navigator.setMode(mode);
    constexpr const char* kModes[] = {"fly", "orbit", "walk"};
    say(kModes[size_t(mode)]);
}

void WindowSession::findTarget(const DrawnPose& drawn)
{
    const Camera& camera = drawn.asked.shot.camera;
    const std::optional<double> depth =
        medianDepth({drawn.delivery.eyes[0].depth, size_t(camera.width) * camera.height});
    if (!depth)
        return;
    m_ahead = *depth;
    if (m_navigator.mode() == NavigationMode::Orbit)
        m_navigator.setDistance(m_ahead);
}

// Shows the model of a dropped file next, if it can be shown; otherwise says why not.
void WindowSession::openDropped(const std::string& file)
{
    WindowModel model{m_options, nullptr};
    PlayOptions& play = model.options.play;
    play.model.file = file;
    play.cameras = {};
    try {
        Reporter silent({ReportFormat::Text, ProgressMode::None, true});
        model.scene = openScene(play.model, play.devices, m_report);
        checkLevelOptions(*model.scene, file, play.frame);
        (void)shotsOf(*model.scene, play, play.view.eyes, play.view.ipd, silent);
        (void)checkedGuard(*model.scene, file, play.frame, guarded(play.frame));
        m_next = std::move(model);
    } catch (const Error& e) {
        if (e.code() != ErrorCode::Interrupted) // an interrupt ends the loop as closing does
            say(warningText(e));
    } catch (const std::exception& e) {
        say(file + ": " + e.what());
    }
}

void WindowSession::jump(int camera, bool animated)
{
    m_camera = camera;
    const Camera& own = m_shots[size_t(camera)].camera;
    m_tan_x = std::tan(own.fov_x / 2) + std::abs(own.tan_mid_x); // the window looks along the axis
    m_tan_y = std::tan(own.fov_y / 2) + std::abs(own.tan_mid_y);
    if (animated)
        m_navigator.animateTo(m_shots[size_t(camera)].camera, kCameraSeconds);
    else
        m_navigator.jumpTo(m_shots[size_t(camera)].camera);
    say("camera " + m_shots[size_t(camera)].camera.name);
}

// Fly is as fast as is useful here: far above a landscape faster than before a table.
void WindowSession::setPace(double seconds)
{
    const double wanted = kPace * m_ahead;
    if (!(wanted > 0))
        return;
    const bool smooth = m_pace > 0 && m_controls.moving();
    m_pace = smooth ? m_pace * std::pow(wanted / m_pace, 1 - std::exp(-seconds / kPaceSeconds)) : wanted;
    m_navigator.setUsualSpeed(m_pace);
}

void WindowSession::move(double seconds)
{
    setPace(seconds);
    const uint32_t width = std::max(eyeWidth(), 1u), height = std::max(m_input.height, 1u);
    const NavigationInput motion = m_controls.motion(seconds, height, 2 * std::atan(fittedTangent(width, height)));
    const auto any = [](const double(&way)[2]) { return way[0] != 0 || way[1] != 0; };
    const bool by_hand = m_controls.moving() || any(motion.look_pixels) || any(motion.pan_pixels) || motion.scroll != 0;
    m_plays = m_plays && !by_hand;
    if (m_plays && !m_navigator.moves())
        jump(int((size_t(m_camera) + 1) % m_shots.size()), true);
    (void)m_navigator.step(motion);
}

void WindowSession::ask()
{
    const View wanted = view();
    if (m_recorder.records())
        (void)m_recorder.add(now(), wanted.camera, m_settings.two_eyes ? m_ipd : 0);
    if (m_seeking && m_source.waiting())
        return; // wait for the depth picture: a newer pose would replace it
    m_seeking = false;
    m_seeks = m_seeks || measures(wanted);
    if (wanted == m_view && !m_changed && !m_again && !m_seeks)
        return;
    m_worked_last_turn = true;
    // only when the view has been drawn with the current settings, or moves on
    if (m_seeks && (!m_changed || m_loading) && (!m_source.waiting() || m_controls.moving()))
        return seekDepth(wanted);
    if (wanted == m_view && !m_changed && !m_again)
        return;
    if (m_changed || !(wanted == m_view)) {
        m_comparison.moved(now());
        m_rest.changed();
    }
    m_view = wanted;
    m_changed = m_again = false;
    try {
        m_asked = m_source.submit(pose(wanted), frameOptionsNow());
        m_worked = m_settings;
    } catch (const Error& e) {
        if (e.code() != ErrorCode::Usage && e.code() != ErrorCode::Unsupported)
            throw;
        say(warningText(e)); // the new settings were refused: return to the last ones that worked
        const ViewSettings refused = m_settings;
        m_settings = m_worked;
        m_settings.compare = refused.compare;
        m_guard = frameGuard(*m_scene, m_settings.choice, guarded(m_settings.choice));
        m_asked = m_source.submit(pose(wanted), frameOptionsNow());
    }
}

void WindowSession::takePicture()
{
    std::optional<DrawnPose> drawn =
        m_source.next(m_dirty && m_shown.empty() ? std::chrono::milliseconds(0) : kPictureWait);
    if (!drawn) {
        const uint64_t failed = m_source.stats().counts.of(PoseEnd::Failed);
        if (failed > m_failed && !m_source.waiting()) {
            m_changed = ++m_attempts < kAttempts; // submits the same pose again, up to kAttempts times
            say(m_changed ? "a picture could not be drawn; it is tried again"
                          : "a picture could not be drawn; the next pose is tried");
        }
        m_failed = failed;
        return;
    }
    m_worked_last_turn = true;
    m_attempts = 0;
    if (drawn->asked.wants_depth) {
        findTarget(*drawn);
        return;
    }
    if (drawn->asked.format != PixelFormat::Rgba8) {
        m_dirty = m_comparison.take(*drawn) || m_dirty;
        return;
    }
    ++m_history.summary.pictures;
    m_last = drawn->delivery.result;
    if (m_last.anchors_absent > 0) {
        say(formatString("loading: %s of %s anchors are still to come", formatCount(m_last.anchors_absent).c_str(),
                         formatCount(m_scene->anchorCount()).c_str()));
        m_changed = true; // more anchors have arrived meanwhile, so draw the view again
    } else if (std::exchange(m_loading, false))
        say("loaded");
    m_loading = m_last.anchors_absent > 0;
    hold(m_last.times.total);
    if (drawn->delivery.pose == m_asked)
        m_again = m_rest.goOn(m_last.coarse, m_guard && m_guard->gaveUp());
    m_panel->addFrame({&m_last, drawn->asked.eyes, drawn->latencyMs()});
    m_shown.push_back(std::move(*drawn));
    while (m_shown.size() > 3) // keep the newest, and two that the display may be reading
        m_shown.pop_front();
    m_dirty = true;
}

void WindowSession::say(const std::string& message)
{
    m_overlay.message = message;
    m_message_ends = now() + kMessageSeconds;
    m_dirty = true;
}

WindowHistory WindowSession::finish()
{
    if (m_recorder.records())
        writeRecording();
    m_presenter.finish();
    m_history.summary.file = m_options.play.model.file;
    m_history.summary.seconds = now();
    m_history.summary.service = m_source.stats();
    return std::move(m_history);
}

} // namespace gsc
