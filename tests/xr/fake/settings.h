// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "openxr_headers.h"

#include <map>
#include <optional>
#include <string>
#include <vector>

namespace gsc::fake_xr {

struct ViewSettings {
    XrFovf fov;  // radians
    XrPosef eye; // in the head's axes, metres
    uint32_t width, height;
};

struct PoseKey {
    double t; // seconds after the predicted display time of frame 0
    XrPosef pose;
};

struct InputKey {
    double t;
    std::string path; // with its component, such as /user/hand/left/input/trigger/value
    float value;
};

struct MaskSettings {
    std::vector<XrVector2f> vertices;
    std::vector<uint32_t> indices;
};
using Masks = std::map<uint32_t, MaskSettings>; // by view

struct ScriptedEvent {
    int64_t frame;
    std::string what;
    uint32_t polls; // "restart" only: calls of xrPollEvent without an event before READY
    Masks masks;    // "mask" only: that hold from then on, of the views they name
};

struct RateChange {
    int64_t frame;
    double hz;
};

enum class Configuration { Stereo, Mono, Quad };

// Behaviour of the headset, as a test sets it. README.md has the table of the keys.
struct Settings {
    bool real_clock = false;
    double hz = 90;
    std::vector<RateChange> rate_changes;
    uint32_t blocked_ms = 5000; // xrWaitFrame gives up after so long without the xrBeginFrame it waits for

    Configuration configuration = Configuration::Stereo;
    std::vector<ViewSettings> views;

    std::vector<PoseKey> head; // empty = a wobble
    float floor = 1.6f;
    bool stage = true;
    std::vector<std::pair<double, double>> tracking_lost;
    std::vector<PoseKey> gaze;                         // rotations in the head's axes; empty = no such tracker
    std::map<std::string, std::vector<PoseKey>> hands; // by user path, poses in LOCAL
    std::string profile = "/interaction_profiles/oculus/touch_controller";
    std::vector<InputKey> inputs;

    std::vector<ScriptedEvent> events; // by frame
    std::optional<std::vector<int64_t>> formats;
    std::vector<std::string> extensions_withheld;
    bool system = true;
    XrVersion vulkan_min = XR_MAKE_VERSION(1, 0, 0);
    uint32_t gpu = 0;
    std::optional<Masks> visibility_mask; // none: the extension is not offered

    std::string log, dump; // empty = none
    bool hash = true;
};

// Reads the file that GSC_FAKE_XR names; the defaults if it names none. Throws std::runtime_error.
Settings readSettings();

} // namespace gsc::fake_xr
