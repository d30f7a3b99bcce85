// SPDX-License-Identifier: Apache-2.0
// Input of hands and eyes, from OpenXR's actions: grab, stick, teleport, menu, two poses of each hand, and gaze.
#pragma once

#include "player/present/headset/headset.h"
#include "player/present/headset/xr_call.h"

namespace gsc {

class XrActions {
public:
    // Makes the actions, and binds them to the inputs of known controllers. `gaze`: the eyes' direction, too. Throws
    // Error(Device).
    XrActions(XrInstance instance, bool gaze);
    ~XrActions();
    XrActions(const XrActions&) = delete;
    XrActions& operator=(const XrActions&) = delete;

    void attach(XrSession session); // attaches the actions to a session; call it once
    // Reads the input; poses are in space `base` at `time`. While the session has no focus no button is held.
    HeadsetInput read(XrSession session, XrSpace base, XrTime time);

private:
    struct PoseAction {
        XrAction action = XR_NULL_HANDLE;
        XrSpace spaces[2] = {};
    };

    XrAction makeAction(const char* name, const char* title, XrActionType type, bool per_hand);
    [[nodiscard]] XrPath path(const std::string& text) const;
    void suggest();
    std::optional<SpacePose> where(XrSession session, const PoseAction& pose, int hand, XrSpace base,
                                   XrTime time) const;

    XrInstance m_instance;
    bool m_gazes;
    XrActionSet m_set = XR_NULL_HANDLE;
    XrPath m_hands[2] = {};
    XrAction m_grab = XR_NULL_HANDLE, m_stick = XR_NULL_HANDLE, m_teleport = XR_NULL_HANDLE, m_menu = XR_NULL_HANDLE;
    PoseAction m_grip, m_aim, m_gaze;
};

} // namespace gsc
