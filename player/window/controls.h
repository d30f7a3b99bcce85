// SPDX-License-Identifier: Apache-2.0
// Translates keys, mouse and gamepad into actions and motion for the window.
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
    FullScreen,
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

// Returns the lines of the help: keys and their effects.
std::vector<std::pair<std::string, std::string>> helpLines();

class Controls {
public:
    // Takes the input since the last call and returns the actions that it asks for, in order.
    std::vector<Action> take(const WindowInput& input);

    // Motion that the person asks for during the last `seconds`. Motion of the mouse is reported once only. `height`
    // in pixels and `fov_y` in radians are the picture's.
    NavigationInput motion(double seconds, uint32_t height, double fov_y);

    // true while a key or a stick is held: motion() then moves the camera without new events
    [[nodiscard]] bool moving() const;

    // Names of the keys that were pressed in the last take(), as the log states them: "W", "F12".
    [[nodiscard]] const std::vector<std::string>& pressed() const { return m_pressed; }

private:
    [[nodiscard]] bool held(int key) const { return m_keys.contains(key); }
    [[nodiscard]] double axis(int positive, int negative) const;
    [[nodiscard]] double stick(int axis) const;
    [[nodiscard]] double trigger(int axis) const;

    std::set<int> m_keys, m_buttons; // codes of the keys and mouse buttons that are held
    double m_x = 0, m_y = 0;         // place of the cursor, pixels
    bool m_knows_cursor = false;
    double m_look[2] = {}, m_pan[2] = {}, m_scroll = 0;
    GamepadState m_gamepad;
    std::vector<std::string> m_pressed;
};

} // namespace gsc
