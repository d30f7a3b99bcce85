// SPDX-License-Identifier: Apache-2.0
// An open window: input, poses, pictures and files, one turn of the loop after the other.
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

class WindowSession {
public:
    WindowSession(const WindowOptions& options, std::shared_ptr<const Scene> scene, Presenter& presenter,
                  Reporter& log);

    bool step();            // false: the window is to close. Throws Error
    WindowSummary finish(); // throws Error(Io) where the path that is being recorded cannot be written
    [[nodiscard]] bool hasWritten() const { return !m_summary.files.empty() || !m_options.log.empty(); }
    void keepRecording() noexcept; // writes the path that is being recorded, if one is; says where or why not

private:
    using Clock = std::chrono::steady_clock;

    // Camera and size that a picture is drawn for; a change of them calls for a new one.
    struct View {
        Camera camera;
        uint32_t width = 0, height = 0; // size of the window
        bool operator==(const View& other) const;
    };

    void act(Action action);
    void takePanel();
    void move(double seconds);
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
    void writeRecording(); // throws Error(Io)
    void jump(int camera, bool animated);
    void changeSettings(const ViewSettings& settings);
    void say(const std::string& message);
    void hold(double frame_ms);
    [[nodiscard]] bool idle() const;
    // false while it is minimised
    [[nodiscard]] bool hasSize() const { return m_input.width > 0 && m_input.height > 0; }
    [[nodiscard]] bool compares() const { return m_comparison.ready() && m_settings.compare != CompareMode::Off; }
    [[nodiscard]] Camera lens(uint32_t width, uint32_t height) const;
    [[nodiscard]] View view() const;
    [[nodiscard]] AskedPose pose(const View& view) const;
    [[nodiscard]] FrameOptions frameOptionsNow() const;
    [[nodiscard]] std::string settingsText() const;
    [[nodiscard]] std::string whyNot(const FrameChoice& choice) const; // why it cannot be switched to; empty = it can
    [[nodiscard]] Guarded guarded(const FrameChoice& choice) const;
    [[nodiscard]] std::string freeName(const char* stem, const std::vector<const char*>& endings) const;
    [[nodiscard]] double now() const { return std::chrono::duration<double>(Clock::now() - m_start).count(); }

    WindowOptions m_options;
    std::shared_ptr<const Scene> m_scene;
    bool m_loading = false; // the last picture shows some of it only
    Presenter& m_presenter;
    Reporter& m_report;
    FrameSource m_source;
    std::vector<Shot> m_shots;
    double m_ipd = 0;   // distance between two eyes; 0 = none are possible
    double m_tan_y = 1; // half of the window's height at depth 1
    Navigator m_navigator;
    Controls m_controls;
    std::optional<FrameGuard> m_guard; // holds --target-ms
    ViewSettings m_settings, m_worked; // wanted; that a pose was last taken with
    Overlay m_overlay;
    std::unique_ptr<Panel> m_panel;
    PathRecorder m_recorder;
    std::unique_ptr<JsonLines> m_log;
    std::string m_no_stereo; // why two eyes cannot be shown, empty = they can

    Clock::time_point m_start = Clock::now();
    double m_last_step = 0, m_last_show = 0, m_message_ends = 0;
    WindowInput m_input;
    View m_view;           // view asked for last
    bool m_changed = true; // settings are others than those asked for
    bool m_again = false;  // the view shows more than before, draw it again
    RestPictures m_rest;
    uint64_t m_asked = 0;          // pose of m_view
    std::deque<DrawnPose> m_shown; // newest last; the display may still read those before
    FrameResult m_last;            // result of the newest picture
    int m_camera = 0;              // camera of the file that was jumped to last
    bool m_plays = false;          // goes through the cameras
    // depth ahead, as the point to turn about: is to be asked for; was asked for
    bool m_seeks = false, m_seeking = false;
    bool m_dirty = true, m_wants_screenshot = false, m_closes = false;
    bool m_worked_last_turn = true;
    uint64_t m_failed = 0;           // poses so far
    int m_attempts = 0;              // tries of the picture that failed last
    std::vector<std::string> m_keys; // since the frame shown last
    std::string m_wrote;

    RestComparison m_comparison{m_source};
    WindowSummary m_summary;
};

} // namespace gsc
