// SPDX-License-Identifier: Apache-2.0
#include "player/window/controls.h"

#include "player/present/keys.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <optional>

namespace gsc {

namespace {

constexpr double kDeadZone = 0.15; // a stick that is deflected less counts as at rest, share of full deflection

struct KeyRow {
    int key;
    Action action;
    const char *name, *does;
};

constexpr KeyRow kKeys[] = {
    {kKeyF1, Action::Help, "F1", "this help"},
    {kKeyTab, Action::Panel, "Tab", "panel of figures and switches"},
    {kKeyF2, Action::PanelKeys, "F2", "arrows and Space move through the panel, Escape gives them back"},
    {kKeyF11, Action::FullScreen, "F11", "cover the screen, or a window again"},
    {'1', Action::Fly, "1", "fly"},
    {'2', Action::Orbit, "2", "orbit about what is ahead"},
    {'3', Action::Walk, "3", "walk at this height"},
    {'L', Action::LevelOut, "L", "hold the horizon level"},
    {kKeyPageDown, Action::NextCamera, "PageDown", "next camera of the file"},
    {kKeyPageUp, Action::PreviousCamera, "PageUp", "camera before"},
    {kKeyHome, Action::FirstCamera, "Home", "first camera"},
    {kKeySpace, Action::PlayCameras, "Space", "go through the cameras, or stop"},
    {'T', Action::NextTier, "T", "tier: exact or fast"},
    {'U', Action::NextReuse, "U", "reuse: none, depth or error"},
    {'G', Action::NextDetail, "G", "groups that are far coarse: detail of 1, 2 or 4 pixels, or off"},
    {'V', Action::NextView, "V", "picture, or false colours: level, age, cost, detail"},
    {'O', Action::Stereo, "O", "two eyes side by side, or one"},
    {kKeyComma, Action::LessDetail, ",", "a quarter of a level less detail"},
    {kKeyPeriod, Action::MoreDetail, ".", "a quarter of a level more"},
    {'X', Action::Compare, "X", "compare with exact at rest: split, difference, off"},
    {kKeyLeftBracket, Action::SplitLeft, "[", "split further left"},
    {kKeyRightBracket, Action::SplitRight, "]", "split further right"},
    {'R', Action::Record, "R", "record the path, or stop and write it"},
    {kKeyF12, Action::Screenshot, "F12", "write the picture and its camera"},
    {kKeyEscape, Action::Escape, "Escape", "close help and panel"},
    {'Q', Action::Close, "Ctrl+Q", "close the window"},
};

struct PadRow {
    int button;
    Action action;
};
constexpr PadRow kPad[] = {{kPadA, Action::PlayCameras},
                           {kPadB, Action::Compare},
                           {kPadX, Action::Record},
                           {kPadY, Action::NextView},
                           {kPadBack, Action::Panel},
                           {kPadStart, Action::Help},
                           {kPadLeftBumper, Action::PreviousCamera},
                           {kPadRightBumper, Action::NextCamera}};

std::string keyName(int key)
{
    for (const KeyRow& row : kKeys)
        if (row.key == key)
            return key == 'Q' ? "Q" : row.name;
    switch (key) {
    case kKeyUp:
        return "Up";
    case kKeyDown:
        return "Down";
    case kKeyLeft:
        return "Left";
    case kKeyRight:
        return "Right";
    case kKeyLeftShift:
    case kKeyRightShift:
        return "Shift";
    case kKeyLeftControl:
    case kKeyRightControl:
        return "Ctrl";
    case kKeyLeftAlt:
    case kKeyRightAlt:
        return "Alt";
    default:
        return key > 32 && key < 127 ? std::string(1, char(key)) : "key " + std::to_string(key);
    }
}

} // namespace

std::vector<std::pair<std::string, std::string>> helpLines()
{
    std::vector<std::pair<std::string, std::string>> lines = {
        {"W A S D", "forward, left, back, right"},
        {"Q E", "down, up"},
        {"arrows", "look round"},
        {"Shift, Alt", "four times as fast, a quarter as fast"},
        {"left button", "look round, or turn about the target"},
        {"right button", "in orbit: move the picture"},
        {"wheel, - =", "speed, which else follows what is ahead, or distance from the target"},
        {"dropped file", "another model: a .gsc, or a trained model's folder"},
        {"gamepad", "sticks move and look, triggers go down and up"},
    };
    for (const KeyRow& row : kKeys)
        lines.emplace_back(row.name, row.does);
    return lines;
}

std::vector<Action> Controls::take(const WindowInput& input)
{
    std::vector<Action> actions;
    m_pressed.clear();
    for (const InputEvent& event : input.events) {
        switch (event.kind) {
        case InputEvent::Kind::Key: {
            if (!event.down) { // a key that the panel took counts as released, too
                m_keys.erase(event.code);
                break;
            }
            m_pressed.push_back(keyName(event.code));
            const bool control = (event.modifiers & kModifierControl) != 0;
            const auto row = std::ranges::find(kKeys, event.code, &KeyRow::key);
            const bool closes = event.code == 'Q' && control;
            // keys that leave the panel must work while it has the keyboard
            const bool always = event.code >= kKeyF1 || event.code == kKeyEscape || event.code == kKeyTab || closes;
            if (event.overlay && !always)
                break;
            if (row != std::end(kKeys) && (row->action != Action::Close || closes))
                actions.push_back(row->action);
            else
                m_keys.insert(event.code);
            if (event.code == kKeyMinus || event.code == kKeyEqual)
                m_scroll += event.code == kKeyEqual ? 1 : -1;
            break;
        }
        case InputEvent::Kind::Button:
            if (!event.down)
                m_buttons.erase(event.code);
            else if (!event.overlay)
                m_buttons.insert(event.code);
            break;
        case InputEvent::Kind::Move: {
            const double dx = event.x - m_x, dy = event.y - m_y;
            m_x = event.x;
            m_y = event.y;
            double* const moved = m_buttons.contains(kMouseLeft)    ? m_look
                                  : m_buttons.contains(kMouseRight) ? m_pan
                                                                    : nullptr;
            if (moved != nullptr && m_knows_cursor) {
                moved[0] += dx;
                moved[1] += dy;
            }
            m_knows_cursor = true;
            break;
        }
        case InputEvent::Kind::Scroll:
            if (!event.overlay)
                m_scroll += event.y;
            break;
        }
    }
    for (const PadRow& row : kPad)
        if ((input.gamepad.buttons >> row.button & 1) != 0 && (m_gamepad.buttons >> row.button & 1) == 0)
            actions.push_back(row.action);
    m_gamepad = input.gamepad;
    return actions;
}

double Controls::axis(int positive, int negative) const
{
    return double(held(positive)) - double(held(negative));
}

double Controls::stick(int axis) const
{
    const double value = m_gamepad.present ? double(m_gamepad.axes[size_t(axis)]) : 0;
    const double past = std::abs(value) - kDeadZone;
    return past > 0 ? std::copysign(past / (1 - kDeadZone), value) : 0;
}

// Returns how far a trigger is pressed, 0 to 1. A trigger at rest is at -1, but one that was never touched may state
// 0.
double Controls::trigger(int axis) const
{
    const double value = m_gamepad.present ? double(m_gamepad.axes[size_t(axis)]) : 0;
    const double past = value == 0 ? 0 : (value + 1) / 2 - kDeadZone;
    return std::max(past / (1 - kDeadZone), 0.0);
}

NavigationInput Controls::motion(double seconds, uint32_t height, double fov_y)
{
    NavigationInput motion;
    motion.seconds = seconds;
    motion.move[0] = std::clamp(axis('D', 'A') + stick(kAxisLeftX), -1.0, 1.0);
    motion.move[1] = std::clamp(axis('E', 'Q') + trigger(kAxisRightTrigger) - trigger(kAxisLeftTrigger), -1.0, 1.0);
    motion.move[2] = std::clamp(axis('W', 'S') - stick(kAxisLeftY), -1.0, 1.0);
    motion.look_rate[0] = std::clamp(axis(kKeyRight, kKeyLeft) + stick(kAxisRightX), -1.0, 1.0);
    motion.look_rate[1] = std::clamp(axis(kKeyDown, kKeyUp) + stick(kAxisRightY), -1.0, 1.0);
    for (int i = 0; i < 2; ++i) {
        motion.look_pixels[i] = m_look[i];
        motion.pan_pixels[i] = m_pan[i];
        m_look[i] = m_pan[i] = 0;
    }
    motion.scroll = m_scroll;
    m_scroll = 0;
    motion.fast = held(kKeyLeftShift) || held(kKeyRightShift);
    motion.slow = held(kKeyLeftAlt) || held(kKeyRightAlt);
    motion.height = height;
    motion.fov_y = fov_y;
    return motion;
}

bool Controls::moving() const
{
    for (const int key : {int('W'), int('A'), int('S'), int('D'), int('Q'), int('E'), int(kKeyUp), int(kKeyDown),
                          int(kKeyLeft), int(kKeyRight)})
        if (held(key))
            return true;
    for (const int axis : {kAxisLeftX, kAxisLeftY, kAxisRightX, kAxisRightY})
        if (stick(axis) != 0)
            return true;
    return trigger(kAxisLeftTrigger) != trigger(kAxisRightTrigger);
}

} // namespace gsc
