// SPDX-License-Identifier: Apache-2.0
// Output of the window: the pictures and the overlay that it shows, and the screenshots, recordings and log lines that
// it writes.
#include "player/window/window_session.h"

#include <gsc/error.h>
#include "runtime/cli/printed_command.h"
#include "runtime/cli/setting_words.h"
#include "runtime/cameras/length.h"
#include "runtime/image/image_io.h"
#include "runtime/view/colour_legend.h"

#include <algorithm>
#include <utility>
#include <filesystem>

namespace gsc {

namespace {

constexpr double kRecordFps = 72; // frames per second, the same as in the headset paths of `gsc sample paths`

} // namespace

void WindowSession::compareAtRest()
{
    // the shown picture is of the current view and settings
    const bool is_last = !m_changed && !m_again && !m_shown.empty();
    if (m_settings.compare != CompareMode::Off && m_settings.view == FrameView::Picture && m_attempts == 0 && is_last)
        m_comparison.advance(now(), pose(m_view), frameOptionsNow());
}

std::vector<ShownPicture> WindowSession::pictures(FrameToShow& frame)
{
    std::vector<ShownPicture> shown;
    frame.width = m_input.width;
    frame.height = m_input.height;
    if (m_shown.empty())
        return shown;
    const DrawnPose& newest = m_shown.back();
    shown = m_source.shown(newest);
    if (shown.empty()) { // the GPU that held the pictures is lost
        m_shown.clear();
        m_changed = true;
        return shown;
    }
    for (uint32_t e = 0; compares() && e < newest.asked.eyes; ++e) {
        const Picture8& picture = m_comparison.pictures(m_settings.compare, m_settings.split)[e];
        const uint32_t x = shown[e].x;
        shown[e] = {};
        shown[e].pixels = picture.pixels.data();
        shown[e].width = picture.width;
        shown[e].height = picture.height;
        shown[e].x = x;
    }
    // the canvas has the size that the pictures were drawn for, and is scaled if the window's size has changed since
    const uint32_t x = shown.back().x + shown.back().width;
    frame.width = x;
    frame.height = shown.front().height;
    if (newest.asked.eyes == 2 && m_input.height == frame.height && m_input.width == x + 1)
        frame.width = m_input.width; // two eyes of equal width leave one column of an odd width empty
    return shown;
}

// Sets the notes: lines at the top and, for a split, at the lower edge of each eye.
void WindowSession::fillNotes()
{
    using Align = OverlayNote::Align;
    std::vector<OverlayNote>& notes = m_overlay.notes;
    notes.clear();
    if (m_recorder.records())
        notes.push_back({Align::Right, 1, 0, "records"});
    if (m_settings.compare == CompareMode::Off)
        return;
    if (!m_comparison.ready()) {
        notes.push_back({Align::Middle, 0.5f, 0,
                         m_settings.view == FrameView::Picture ? "compared with exact when at rest"
                                                               : "false colours are not compared"});
        return;
    }
    const ComparedNumbers numbers = m_comparison.numbers();
    std::string text = formatString("PSNR %.2f dB, worst %.2f/255, FLIP ", numbers.psnr, numbers.worst_255);
    text += numbers.flip ? formatString("%.5f", *numbers.flip) : "...";
    if (m_settings.compare == CompareMode::Difference)
        text += formatString("; difference times %g", double(Comparison::kGain));
    notes.push_back({Align::Middle, 0.5f, 0, text});
    const float eyes = m_settings.two_eyes ? 2 : 1;
    for (float eye = 0; m_settings.compare == CompareMode::Split && eye < eyes; ++eye) {
        notes.push_back({Align::Left, (eye + 0.01f) / eyes, 1, settingsText()});
        notes.push_back({Align::Right, (eye + 0.99f) / eyes, 1, "exact"});
    }
}

void WindowSession::fillOverlay()
{
    if (now() > m_message_ends)
        m_overlay.message.clear();
    fillNotes();
    constexpr const char* kMeanings[] = {"", "level", "frames since decoded", "Gaussians evaluated", "groups"};
    m_overlay.legend = {kMeanings[size_t(m_settings.view)], {}};
    for (const LegendColour& colour : colourLegend(m_settings.view, m_scene->view().params->level_count))
        m_overlay.legend.colours.push_back({{colour.rgb[0], colour.rgb[1], colour.rgb[2]}, colour.text});
    if (!m_overlay.panel)
        return;
    m_panel->setSettings(m_settings, m_camera, int(m_navigator.mode()), m_navigator.speed());
    const std::array<double, 3> position = m_navigator.position();
    m_panel->setFacts(m_source.stats(), m_last, m_source.device() + ", shown by " + m_presenter.deviceName(),
                      formatString("%.4g, %.4g, %.4g", position[0], position[1], position[2]), m_recorder.records());
}

void WindowSession::show(const WindowInput& input)
{
    FrameToShow frame;
    const std::vector<ShownPicture> shown = pictures(frame);
    frame.pictures = shown;
    const bool fits = !shown.empty() && frame.width == input.width && frame.height == input.height;
    frame.reads_back = m_wants_screenshot && fits;
    const double at = now();
    const double refresh = 1000 * (at - m_last_show);
    fillOverlay();
    if (frame.width == 0 || frame.height == 0 || !m_presenter.show(frame, &m_overlay)) {
        m_last_show = at;
        m_dirty = input.width > 0 && input.height > 0; // nothing was shown: try again, unless the window is minimised
        return;
    }
    m_last_show = at;
    m_dirty = compares() && !m_comparison.complete();
    m_panel->addRefresh(refresh, std::exchange(m_rested, false));
    ++m_history.summary.frames;
    if (frame.reads_back) {
        m_wants_screenshot = false;
        writeScreenshot();
    }
    WindowFrame line;
    line.frame = m_history.summary.frames;
    line.seconds = at;
    if (!m_shown.empty()) {
        const AskedPose& asked = m_shown.back().asked;
        line.pose = m_shown.back().delivery.pose;
        line.lod_bias = double(asked.lod_bias);
        line.detail = double(asked.detail);
        line.fovea_pixels = double(asked.fovea_pixels);
    }
    line.asked = m_asked;
    line.keys = std::exchange(m_keys, {});
    line.width = input.width;
    line.height = input.height;
    line.refresh_ms = refresh;
    line.latency_ms = m_shown.empty() ? 0 : m_shown.back().latencyMs();
    line.anchors_absent = m_shown.empty() ? 0 : m_shown.back().delivery.result.anchors_absent;
    std::ranges::copy(m_navigator.position(), line.position);
    line.speed = m_navigator.speed();
    constexpr const char* kShows[] = {"picture", "split", "difference"};
    line.shows = kShows[m_comparison.ready() ? size_t(m_settings.compare) : 0];
    if (m_comparison.ready()) {
        const ComparedNumbers numbers = m_comparison.numbers();
        line.psnr = numbers.psnr;
        line.flip = numbers.flip.value_or(-1);
    }
    line.wrote = std::exchange(m_wrote, {});
    line.said = m_overlay.message;
    try {
        m_history.log->add(windowLine(line));
    } catch (const Error& e) { // a full disk does not close the window
        m_report.warning(warningText(e));
        say(warningText(e));
        m_history.log->close();
    }
}

std::string WindowSession::freeName(const char* stem, const std::vector<const char*>& endings) const
{
    for (int i = 1;; ++i) {
        const std::string name = (std::filesystem::path(m_options.folder) / formatString("%s-%04d", stem, i)).string();
        std::error_code unreadable; // if the folder cannot be read, writing will report it
        if (std::ranges::none_of(
                endings, [&](const char* ending) { return std::filesystem::exists(name + ending, unreadable); }))
            return name;
    }
}

void WindowSession::wantScreenshot()
{
    m_wants_screenshot = m_presenter.readsBack();
    if (!m_wants_screenshot)
        say("screenshot: this display's images cannot be read; write pictures with gsc-play FILE --out");
}

// Writes the shown picture, and a camera file from which it can be drawn again.
void WindowSession::writeScreenshot()
{
    uint32_t width = 0, height = 0;
    const std::vector<std::byte> bytes = m_presenter.readBack(width, height);
    Image image{width, height, std::vector<float>(size_t(width) * height * 3)};
    for (size_t i = 0; i < size_t(width) * height; ++i)
        for (size_t c = 0; c < 3; ++c)
            image.pixels[3 * i + c] = float(bytes[4 * i + c]) / 255;
    const std::string name = freeName("gsc", {".png", ".json"});
    try {
        writeImage(name + ".png", image, PixelDepth::Eight, false);
        const Shot& shot = m_shown.back().asked.shot;
        PathRecorder camera;
        camera.start(name, kRecordFps);
        (void)camera.add(0, shot.camera, shot.ipd);
        (void)camera.stop(name + ".json");
    } catch (const Error& e) { // a full disk does not close the window
        say(warningText(e));
        return;
    }
    m_wrote = name + ".png";
    m_history.summary.files.push_back(name + ".png");
    m_history.summary.files.push_back(name + ".json");
    say("wrote " + m_wrote + " and its camera");
}

void WindowSession::keepRecording() noexcept
{
    try {
        if (!m_recorder.records())
            return;
        writeRecording();
        m_report.tell(m_overlay.message);
    } catch (const std::exception& e) {
        m_report.warning(e.what());
    }
}

void WindowSession::toggleRecording()
{
    m_dirty = true;
    if (!m_recorder.records()) {
        const std::optional<Metre> metre = metreOfManifest(m_scene->manifest());
        m_recorder.start("recorded", kRecordFps, metre ? metre->units : 0);
        say("records; R writes the path");
        return;
    }
    try {
        writeRecording();
    } catch (const Error& e) {
        say(warningText(e));
    }
}

void WindowSession::writeRecording()
{
    const std::string name = freeName("path", {".json"}) + ".json";
    (void)m_recorder.stop(name);
    m_wrote = name;
    m_history.summary.files.push_back(name);
    say("wrote " + name + "; gsc-play bench " + shellWord(m_options.play.model.file) + " --cameras " + shellWord(name) +
        " plays it");
}

} // namespace gsc
