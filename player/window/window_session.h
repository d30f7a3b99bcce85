// SPDX-License-Identifier: Apache-2.0
// An open window. Each turn of its loop reads input, submits poses, shows pictures and writes files.
#pragma once

#include "player/window/controls.h"
#include "player/devices/frame_source.h"
#include "player/frames/lod_target.h"
#include "player/window/navigation.h"
#include "player/window/panel.h"
#include "player/window/path_recorder.h"
#include "player/window/rest_comparison.h"
#include "player/window/rest_pictures.h"
#include "player/window/window.h"
#include "runtime/cli/json_lines.h"
#include "player/window/window_log.h"

#include <chrono>
#include <deque>

namespace gsc {

// A model to show.
struct WindowModel {
    WindowOptions options;
    std::shared_ptr<const Scene> scene;
};

// Facts that a session hands on to the next, which shows another model in the same window.
struct WindowHistory {
    std::chrono::steady_clock::time_point start = std::chrono::steady_clock::now();
    std::unique_ptr<JsonLines> log; // none yet: the session opens it
    WindowSummary summary;
};

class WindowSession {
public:
    WindowSession(const WindowModel& model, Presenter& presenter, WindowHistory history, Reporter& log);

    bool step(); // one turn of the loop; returns false if the window is to close or show another model. Throws Error
    // The model of a file that was dropped on the window; none = the window is to close.
    [[nodiscard]] const std::optional<WindowModel>& next() const { return m_next; }
    WindowHistory finish();        // throws Error(Io) if the path that is being recorded cannot be written
    void keepRecording() noexcept; // writes the path that is being recorded, if any; reports its file or the error

private:
    using Clock = std::chrono::steady_clock;

    // Camera and size of a picture; if they change, a new picture is submitted.
    struct View {
        Camera camera;
        uint32_t width = 0, height = 0; // size of the window, pixels
        bool operator==(const View& other) const;
    };

    void act(Action action);
    void takePanel();
    void move(double seconds);
    void setPace(double seconds);
    void openDropped(const std::string& file);
    void seekDepth(const View& wanted);
    void ask();
    void takePicture();
    void setMode(NavigationMode mode);
    void findTarget(const DrawnPose& drawn);
    void compareAtRest();
    void show(const WindowInput& input);
    std::vector<ShownPicture> pictures(FrameToShow& frame);
    void fillNotes();
    void fillOverlay();
    void wantScreenshot();
    void writeScreenshot();
    void toggleRecording();
    void writeRecording(); // writes the recorded path to a file; throws Error(Io)
    void jump(int camera, bool animated);
    void changeSettings(const ViewSettings& settings);
    void say(const std::string& message);
    void hold(double frame_ms);
    [[nodiscard]] bool idle() const;
    // false while the window is minimised
    [[nodiscard]] bool hasSize() const { return m_input.width > 0 && m_input.height > 0; }
    [[nodiscard]] bool compares() const { return m_comparison.ready() && m_settings.compare != CompareMode::Off; }
    [[nodiscard]] uint32_t eyeWidth() const; // pixels
    // Returns half the height at depth 1 of a picture of this size that shows all of the current camera's picture.
    [[nodiscard]] double fittedTangent(uint32_t width, uint32_t height) const;
    [[nodiscard]] Camera lens(uint32_t width, uint32_t height) const;
    [[nodiscard]] View view() const;
    [[nodiscard]] AskedPose pose(const View& view) const;
    [[nodiscard]] FrameOptions frameOptionsNow() const;
    [[nodiscard]] std::string settingsText() const;
    // why these settings cannot be switched on; empty = they can
    [[nodiscard]] std::string whyNot(const FrameChoice& choice) const;
    [[nodiscard]] Guarded guarded(const FrameChoice& choice) const;
    [[nodiscard]] std::string freeName(const char* stem, const std::vector<const char*>& endings) const;
    [[nodiscard]] bool measures(const View& wanted) const;
    [[nodiscard]] double now() const { return std::chrono::duration<double>(Clock::now() - m_history.start).count(); }

    WindowOptions m_options;
    std::shared_ptr<const Scene> m_scene;
    bool m_loading = false; // the last picture lacked anchors that were not loaded yet
    Presenter& m_presenter;
    Reporter& m_report;
    FrameSource m_source;
    std::vector<Shot> m_shots;
    double m_ipd = 0; // distance between two eyes, world units; 0 = two eyes are not possible
    // tangents of half the angles of view of the current camera: half the width and height of its picture at depth 1
    double m_tan_x = 1, m_tan_y = 1;
    Navigator m_navigator;
    Controls m_controls;
    std::optional<FrameGuard> m_guard; // lowers settings to hold --target-ms; none without that option
    // m_settings: as the person wants them; m_worked: as of the last pose that was accepted
    ViewSettings m_settings, m_worked;
    Overlay m_overlay;
    std::unique_ptr<Panel> m_panel;
    PathRecorder m_recorder;
    std::string m_no_stereo; // reason why two eyes cannot be shown; empty = they can

    WindowHistory m_history;
    std::optional<WindowModel> m_next;
    double m_last_step = 0, m_last_show = 0, m_message_ends = 0;
    WindowInput m_input;
    View m_view;           // view that was submitted last
    bool m_changed = true; // the settings differ from those submitted last
    bool m_again = false;  // submit the view again: a new picture would show more
    RestPictures m_rest;
    uint64_t m_asked = 0;          // number of the pose that was submitted for m_view
    std::deque<DrawnPose> m_shown; // finished pictures, the newest last; the display may still read the earlier ones
    FrameResult m_last;            // counts and times of the newest picture
    int m_camera = 0;              // index of the stored camera that was jumped to last
    bool m_plays = false;          // true: the window flies from camera to camera
    // m_seeks: the depth in the middle of the view is wanted, for the point that Orbit turns about; m_seeking: a
    // picture with that depth has been submitted
    bool m_seeks = false, m_seeking = false;
    View m_measured;          // view whose depth was wanted last
    double m_measured_at = 0; // and when, seconds
    // m_ahead: distance to what the middle of the view shows, world units, 0 = not known; m_pace: Fly's default speed,
    // which follows it
    double m_ahead = 0, m_pace = 0;
    bool m_rested = false; // the window had nothing to show since the last frame
    bool m_dirty = true, m_wants_screenshot = false, m_closes = false;
    bool m_worked_last_turn = true;
    uint64_t m_failed = 0;           // number of poses that failed so far
    int m_attempts = 0;              // failed tries of the current picture
    std::vector<std::string> m_keys; // keys pressed since the last frame
    std::string m_wrote;

    RestComparison m_comparison{m_source};
};

} // namespace gsc
