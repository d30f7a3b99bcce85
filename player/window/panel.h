// SPDX-License-Identifier: Apache-2.0
// The panel over the picture: facts of the frames, and controls.
#pragma once

#include "player/options/frame_choice.h"
#include "player/present/overlay.h"
#include "player/window/comparison.h"
#include "runtime/service/renderer_service.h"

#include <array>
#include <string>
#include <utility>
#include <vector>

namespace gsc {

// Steps of the detail in pixels that the window offers, with their labels.
constexpr std::array<std::pair<const char*, double>, 4> kDetails{{{"off", 0}, {"1", 1}, {"2", 2}, {"4", 4}}};

// Settings that the person changes while the window is open.
struct ViewSettings {
    FrameChoice choice;
    bool two_eyes = false;
    float background[3] = {};
    FrameView view = FrameView::Picture;
    CompareMode compare = CompareMode::Off;
    double split = 0.5; // place of the dividing line of a split, share of the width
};

// Settings that cannot be switched on with this model, and why.
struct ViewLimits {
    bool has_levels = false;
    std::string no_stereo; // reason why two eyes cannot be shown; empty = they can
};

// Numbers of one picture that was shown.
struct PanelFrame {
    const FrameResult* result = nullptr;
    uint32_t eyes = 1;
    double latency_ms = 0; // time from submitting the pose until its picture was finished
};

class Panel {
public:
    Panel(const ViewLimits& limits, std::vector<std::string> cameras, Overlay& overlay);

    void setSettings(const ViewSettings& settings, int camera, int mode, double speed);
    // Writes the person's changes into the settings, the chosen camera (index, -1 = none) and the mode. Returns false
    // if nothing changed.
    bool take(ViewSettings& settings, int& camera, int& mode, bool& screenshot, bool& record);

    void addFrame(const PanelFrame& frame);
    // Adds the time from one refresh of the window to the next to the plot; `rested`: the window had nothing to show in
    // that time, so it is no time of a frame.
    void addRefresh(double ms, bool rested);
    void setFacts(const ServiceStats& stats, const FrameResult& last, const std::string& device,
                  const std::string& pose, bool recording);

private:
    OverlayItem& item(const char* label);
    void add(OverlayItem::Kind kind, const char* label, const char* hint = "");
    void plot(const char* label, double value);

    Overlay& m_overlay;
};

} // namespace gsc
