// SPDX-License-Identifier: Apache-2.0
// Actions and motion that keys, mouse and gamepad ask of the window.
#pragma once

#include "player/present/presenter.h"
#include "player/window/navigation.h"

#include <set>
#include <span>
#include <string>
#include <vector>

namespace gsc {

enum class Action {
    Help,
    Panel,
    PanelKeys,
    Escape,
    Close,
    Screenshot,
    Record,
    NextCamera,
    PreviousCamera,
    FirstCamera,
    PlayCameras,
    Fly,
    Orbit,
    Walk,
    LevelOut,
    NextTier,
    NextReuse,
    NextDetail,
    NextView,
    Stereo,
    LessDetail,
    MoreDetail,
    Compare,
    SplitLeft,
    SplitRight,
};

// Lines of the help: keys and their effects.
std::vector<std::pair<std::string, std::string>> helpLines();

class Controls {
public:
    // Takes the input since the last call; returns its actions in order.
    std::vector<Action> take(const WindowInput& input);

    // Movement of the viewer in the last `seconds`; the mouse's movement counts once.
    NavigationInput motion(double seconds, uint32_t height, double fov_y);

    [[nodiscard]] bool moving() const; // true while a key or a stick is held: motion() then moves without events

    // Keys that went down in the last take(), as the log has them: "W", "F12".
    [[nodiscard]] const std::vector<std::string>& pressed() const { return m_pressed; }

private:
    [[nodiscard]] bool held(int key) const { return m_keys.contains(key); }
    [[nodiscard]] double axis(int positive, int negative) const;
    [[nodiscard]] double stick(int axis) const;
    [[nodiscard]] double trigger(int axis) const;

    std::set<int> m_keys, m_buttons; // keys and buttons that are down
    double m_x = 0, m_y = 0;         // place of the cursor
    bool m_knows_cursor = false;
    double m_look[2] = {}, m_pan[2] = {}, m_scroll = 0;
    GamepadState m_gamepad;
    std::vector<std::string> m_pressed;
};

} // namespace gsc
