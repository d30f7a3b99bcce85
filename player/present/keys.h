// SPDX-License-Identifier: Apache-2.0
// Codes of keys and buttons in an InputEvent. Letters and digits have their ASCII codes, letters those of capitals.
// The values are GLFW's, which glfw_window.cpp checks.
#pragma once

namespace gsc {

enum Key : int {
    kKeySpace = 32,
    kKeyComma = 44,
    kKeyMinus = 45,
    kKeyPeriod = 46,
    kKeyEqual = 61,
    kKeyLeftBracket = 91,
    kKeyRightBracket = 93,
    kKeyEscape = 256,
    kKeyTab = 258,
    kKeyRight = 262,
    kKeyLeft = 263,
    kKeyDown = 264,
    kKeyUp = 265,
    kKeyPageUp = 266,
    kKeyPageDown = 267,
    kKeyHome = 268,
    kKeyF1 = 290,
    kKeyF2 = 291,
    kKeyF11 = 300,
    kKeyF12 = 301,
    kKeyLeftShift = 340,
    kKeyLeftControl = 341,
    kKeyLeftAlt = 342,
    kKeyRightShift = 344,
    kKeyRightControl = 345,
    kKeyRightAlt = 346,
};

enum MouseButton : int { kMouseLeft = 0, kMouseRight = 1 };

constexpr int kModifierControl = 2;

// Codes of a gamepad's buttons and axes.
enum GamepadButton : int {
    kPadA = 0,
    kPadB = 1,
    kPadX = 2,
    kPadY = 3,
    kPadLeftBumper = 4,
    kPadRightBumper = 5,
    kPadBack = 6,
    kPadStart = 7,
};
enum GamepadAxis : int {
    kAxisLeftX = 0,
    kAxisLeftY = 1,
    kAxisRightX = 2,
    kAxisRightY = 3,
    kAxisLeftTrigger = 4,
    kAxisRightTrigger = 5,
};

} // namespace gsc
