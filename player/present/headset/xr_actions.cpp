// SPDX-License-Identifier: Apache-2.0
#include "player/present/headset/xr_actions.h"

#include <vector>

namespace gsc {

namespace {

constexpr const char* kHands[] = {"/user/hand/left", "/user/hand/right"};

// OpenXR paths of a controller's inputs, relative to its hand; null: the controller lacks the input. If an action
// wants a float and the input is a mere button, OpenXR gives 0 or 1.
struct Controller {
    const char* name;
    const char *grab, *stick, *teleport, *menu_left, *menu_right;
};
constexpr Controller kControllers[] = {
    {"khr/simple_controller", "select/click", nullptr, nullptr, "menu/click", "menu/click"},
    {"oculus/touch_controller", "squeeze/value", "thumbstick", "trigger/value", "menu/click", "b/click"},
    {"valve/index_controller", "squeeze/value", "thumbstick", "trigger/value", "b/click", "b/click"},
    {"htc/vive_controller", "squeeze/click", "trackpad", "trigger/value", "menu/click", "menu/click"},
    {"microsoft/motion_controller", "squeeze/click", "thumbstick", "trigger/value", "menu/click", "menu/click"},
};
constexpr const char* kGazeProfile = "/interaction_profiles/ext/eye_gaze_interaction";
constexpr const char* kGazePath = "/user/eyes_ext/input/gaze_ext/pose";

} // namespace

XrActions::XrActions(XrInstance instance, bool gaze) : m_instance(instance), m_gazes(gaze)
{
    auto info = xrInfo<XrActionSetCreateInfo>(XR_TYPE_ACTION_SET_CREATE_INFO);
    setXrText(info.actionSetName, "viewer");
    setXrText(info.localizedActionSetName, "Viewer");
    checkXr(xrCreateActionSet(instance, &info, &m_set), "xrCreateActionSet");
    try {
        for (int hand = 0; hand < 2; ++hand)
            m_hands[hand] = path(kHands[hand]);
        m_grab = makeAction("grab", "Hold the scene", XR_ACTION_TYPE_FLOAT_INPUT, true);
        m_stick = makeAction("stick", "Move and turn", XR_ACTION_TYPE_VECTOR2F_INPUT, true);
        m_teleport = makeAction("teleport", "Go where it points", XR_ACTION_TYPE_BOOLEAN_INPUT, true);
        m_menu = makeAction("menu", "Back to the start", XR_ACTION_TYPE_BOOLEAN_INPUT, true);
        m_grip.action = makeAction("grip", "Hand", XR_ACTION_TYPE_POSE_INPUT, true);
        m_aim.action = makeAction("aim", "Where the hand points", XR_ACTION_TYPE_POSE_INPUT, true);
        if (m_gazes)
            m_gaze.action = makeAction("gaze", "Where the eyes look", XR_ACTION_TYPE_POSE_INPUT, false);
        suggest();
    } catch (...) {
        xrDestroyActionSet(m_set);
        throw;
    }
}

XrActions::~XrActions()
{
    xrDestroyActionSet(m_set); // destroys the actions of the set, too; their spaces went with the session
}

XrPath XrActions::path(const std::string& text) const
{
    XrPath path = XR_NULL_PATH;
    checkXr(xrStringToPath(m_instance, text.c_str(), &path), "xrStringToPath");
    return path;
}

XrAction XrActions::makeAction(const char* name, const char* title, XrActionType type, bool per_hand)
{
    auto info = xrInfo<XrActionCreateInfo>(XR_TYPE_ACTION_CREATE_INFO);
    setXrText(info.actionName, name);
    setXrText(info.localizedActionName, title);
    info.actionType = type;
    info.countSubactionPaths = per_hand ? 2 : 0;
    info.subactionPaths = per_hand ? m_hands : nullptr;
    XrAction action = XR_NULL_HANDLE;
    checkXr(xrCreateAction(m_set, &info, &action), "xrCreateAction");
    return action;
}

void XrActions::suggest()
{
    const auto send = [this](const std::string& profile, const std::vector<XrActionSuggestedBinding>& bindings) {
        auto info = xrInfo<XrInteractionProfileSuggestedBinding>(XR_TYPE_INTERACTION_PROFILE_SUGGESTED_BINDING);
        info.interactionProfile = path(profile);
        info.suggestedBindings = bindings.data();
        info.countSuggestedBindings = uint32_t(bindings.size());
        const XrResult result = xrSuggestInteractionProfileBindings(m_instance, &info);
        // fails if this runtime does not know the controller, which is no error
        if (result != XR_ERROR_PATH_UNSUPPORTED)
            checkXr(result, "xrSuggestInteractionProfileBindings");
    };
    for (const Controller& controller : kControllers) {
        std::vector<XrActionSuggestedBinding> bindings;
        for (int hand = 0; hand < 2; ++hand) {
            const auto bind = [&](XrAction action, const char* input) {
                if (input != nullptr)
                    bindings.push_back({action, path(std::string(kHands[hand]) + "/input/" + input)});
            };
            bind(m_grab, controller.grab);
            bind(m_stick, controller.stick);
            bind(m_teleport, controller.teleport);
            bind(m_menu, hand == 0 ? controller.menu_left : controller.menu_right);
            bind(m_grip.action, "grip/pose");
            bind(m_aim.action, "aim/pose");
        }
        send(std::string("/interaction_profiles/") + controller.name, bindings);
    }
    if (m_gazes)
        send(kGazeProfile, {{m_gaze.action, path(kGazePath)}});
}

void XrActions::attach(XrSession session)
{
    auto info = xrInfo<XrSessionActionSetsAttachInfo>(XR_TYPE_SESSION_ACTION_SETS_ATTACH_INFO);
    info.countActionSets = 1;
    info.actionSets = &m_set;
    checkXr(xrAttachSessionActionSets(session, &info), "xrAttachSessionActionSets");
    const auto make_space = [&](PoseAction& pose, int hand, XrPath of) {
        auto space = xrInfo<XrActionSpaceCreateInfo>(XR_TYPE_ACTION_SPACE_CREATE_INFO);
        space.action = pose.action;
        space.subactionPath = of;
        space.poseInActionSpace.orientation.w = 1;
        checkXr(xrCreateActionSpace(session, &space, &pose.spaces[hand]), "xrCreateActionSpace");
    };
    for (int hand = 0; hand < 2; ++hand) {
        make_space(m_grip, hand, m_hands[hand]);
        make_space(m_aim, hand, m_hands[hand]);
    }
    if (m_gazes)
        make_space(m_gaze, 0, XR_NULL_PATH);
}

std::optional<SpacePose> XrActions::where(XrSession session, const PoseAction& pose, int hand, XrSpace base,
                                          XrTime time) const
{
    auto get = xrInfo<XrActionStateGetInfo>(XR_TYPE_ACTION_STATE_GET_INFO);
    get.action = pose.action;
    get.subactionPath = &pose == &m_gaze ? XR_NULL_PATH : m_hands[hand];
    auto state = xrInfo<XrActionStatePose>(XR_TYPE_ACTION_STATE_POSE);
    checkXr(xrGetActionStatePose(session, &get, &state), "xrGetActionStatePose");
    if (!state.isActive)
        return std::nullopt;
    auto location = xrInfo<XrSpaceLocation>(XR_TYPE_SPACE_LOCATION);
    checkXr(xrLocateSpace(pose.spaces[hand], base, time, &location), "xrLocateSpace");
    constexpr XrSpaceLocationFlags kValid =
        XR_SPACE_LOCATION_POSITION_VALID_BIT | XR_SPACE_LOCATION_ORIENTATION_VALID_BIT;
    if ((location.locationFlags & kValid) != kValid)
        return std::nullopt;
    return poseOf(location.pose);
}

HeadsetInput XrActions::read(XrSession session, XrSpace base, XrTime time)
{
    const XrActiveActionSet active{m_set, XR_NULL_PATH};
    auto sync = xrInfo<XrActionsSyncInfo>(XR_TYPE_ACTIONS_SYNC_INFO);
    sync.countActiveActionSets = 1;
    sync.activeActionSets = &active;
    const XrResult synced = xrSyncActions(session, &sync);
    checkXr(synced, "xrSyncActions");
    HeadsetInput input;
    if (synced == XR_SESSION_NOT_FOCUSED)
        return input;
    for (int hand = 0; hand < 2; ++hand) {
        HandInput& to = input.hands[hand];
        auto get = xrInfo<XrActionStateGetInfo>(XR_TYPE_ACTION_STATE_GET_INFO);
        get.subactionPath = m_hands[hand];
        const auto held = [&](XrAction action) {
            get.action = action;
            auto state = xrInfo<XrActionStateBoolean>(XR_TYPE_ACTION_STATE_BOOLEAN);
            checkXr(xrGetActionStateBoolean(session, &get, &state), "xrGetActionStateBoolean");
            return state.isActive && state.currentState;
        };
        to.teleport = held(m_teleport);
        to.menu = held(m_menu);
        get.action = m_grab;
        auto grab = xrInfo<XrActionStateFloat>(XR_TYPE_ACTION_STATE_FLOAT);
        checkXr(xrGetActionStateFloat(session, &get, &grab), "xrGetActionStateFloat");
        to.grab = grab.isActive ? double(grab.currentState) : 0;
        get.action = m_stick;
        auto stick = xrInfo<XrActionStateVector2f>(XR_TYPE_ACTION_STATE_VECTOR2F);
        checkXr(xrGetActionStateVector2f(session, &get, &stick), "xrGetActionStateVector2f");
        if (stick.isActive) {
            to.stick[0] = double(stick.currentState.x);
            to.stick[1] = double(stick.currentState.y);
        }
        to.grip = where(session, m_grip, hand, base, time);
        to.aim = where(session, m_aim, hand, base, time);
    }
    if (m_gazes)
        input.gaze = where(session, m_gaze, 0, base, time);
    return input;
}

} // namespace gsc
