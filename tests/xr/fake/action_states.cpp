// SPDX-License-Identifier: Apache-2.0
#include "functions.h"
#include "runtime.h"

#include <cmath>

namespace gsc::fake_xr {

namespace {

// Where the value of a suggested path without its component is: .../trigger is .../trigger/value.
float readInput(const Runtime& rt, const std::string& path, XrActionType type, double t)
{
    const auto there = [&](const std::string& p) {
        const auto same = [&](const InputKey& key) { return key.path == p; };
        return std::any_of(rt.settings.inputs.begin(), rt.settings.inputs.end(), same);
    };
    const std::vector<std::string> components = type == XR_ACTION_TYPE_BOOLEAN_INPUT
                                                    ? std::vector<std::string>{"", "/click", "/value", "/force"}
                                                    : std::vector<std::string>{"", "/value", "/force", "/click"};
    for (const std::string& component : components)
        if (there(path + component))
            return inputAt(rt.settings, path + component, t);
    return 0;
}

XrVector2f readSource(const Runtime& rt, const std::string& path, XrActionType type, double t)
{
    if (type == XR_ACTION_TYPE_VECTOR2F_INPUT)
        return {inputAt(rt.settings, path + "/x", t), inputAt(rt.settings, path + "/y", t)};
    const float value = readInput(rt, path, type, t);
    return {type == XR_ACTION_TYPE_BOOLEAN_INPUT ? float(value > 0.5f) : value, 0};
}

// Several sources of one action: OpenXR takes the one that is furthest from rest.
void syncState(Runtime& rt, const Action& action, uint64_t id, const std::string& user_path, ActionState& state)
{
    const double t = rt.scriptTime(rt.predicted);
    XrVector2f value{0, 0};
    bool active = false;
    for (const std::string& path : boundPaths(rt, id, user_path)) {
        if (action.type == XR_ACTION_TYPE_POSE_INPUT) {
            active |= userPathOf(path) == "/user/eyes_ext" || rt.settings.hands.contains(userPathOf(path));
            continue;
        }
        active = true;
        const XrVector2f read = readSource(rt, path, action.type, t);
        if (std::hypot(read.x, read.y) > std::hypot(value.x, value.y))
            value = read;
    }
    state.changed = state.active && active && (value.x != state.value.x || value.y != state.value.y);
    if (state.changed)
        state.last_change = rt.now();
    state.active = active;
    state.value = value;
    if (!active)
        state.last_change = 0;
}

void announceProfiles(Runtime& rt, XrSession session)
{
    if (rt.actions.profile_announced)
        return;
    rt.actions.profile_announced = true;
    rt.send(XrEventDataInteractionProfileChanged{XR_TYPE_EVENT_DATA_INTERACTION_PROFILE_CHANGED, nullptr, session});
    rt.log.line(R"({"event":"interaction_profile_changed"})");
}

const Action& requireAction(const Runtime& rt, XrAction handle, XrActionType type)
{
    const auto found = rt.actions.actions.find(idOf(handle));
    if (found == rt.actions.actions.end())
        refuse(XR_ERROR_HANDLE_INVALID, "no such action");
    const Action& action = found->second;
    if (action.type != type)
        refuse(XR_ERROR_ACTION_TYPE_MISMATCH, formatString("%s has type %d", action.name.c_str(), action.type));
    if (!rt.actions.attached.contains(action.set))
        refuse(XR_ERROR_ACTIONSET_NOT_ATTACHED, "the set of " + action.name + " is not attached");
    return action;
}

std::string requireSubaction(const Runtime& rt, const Action& action, XrPath path)
{
    if (path == XR_NULL_PATH)
        return {};
    std::string text = rt.requirePath(path);
    if (!action.states.contains(text))
        refuse(XR_ERROR_PATH_UNSUPPORTED, text + " is no subaction path of " + action.name);
    return text;
}

const ActionState& requireState(Runtime& rt, XrSession session, const XrActionStateGetInfo* info, XrActionType type)
{
    rt.requireSession(session);
    requireType(info, XR_TYPE_ACTION_STATE_GET_INFO, "getInfo");
    const Action& action = requireAction(rt, info->action, type);
    return action.states.at(requireSubaction(rt, action, info->subactionPath));
}

template <typename State>
void fill(State* out, const ActionState& state)
{
    out->isActive = state.active ? XR_TRUE : XR_FALSE;
    out->changedSinceLastSync = state.changed ? XR_TRUE : XR_FALSE;
    out->lastChangeTime = state.last_change;
}

const Action& requireHaptic(Runtime& rt, XrSession session, const XrHapticActionInfo* info, std::string& user_path)
{
    rt.requireSession(session);
    requireType(info, XR_TYPE_HAPTIC_ACTION_INFO, "hapticActionInfo");
    const Action& action = requireAction(rt, info->action, XR_ACTION_TYPE_VIBRATION_OUTPUT);
    user_path = requireSubaction(rt, action, info->subactionPath);
    return action;
}

} // namespace

XrResult xrSyncActions(XrSession handle, const XrActionsSyncInfo* info)
{
    return guarded("xrSyncActions", [&](Runtime& rt) {
        const Session& session = rt.requireSession(handle);
        requireType(info, XR_TYPE_ACTIONS_SYNC_INFO, "syncInfo");
        std::set<uint64_t> synced;
        for (uint32_t i = 0; i < info->countActiveActionSets; ++i) {
            const XrActiveActionSet& active = info->activeActionSets[i];
            if (!rt.actions.sets.contains(idOf(active.actionSet)))
                refuse(XR_ERROR_HANDLE_INVALID, "no such action set");
            if (!rt.actions.attached.contains(idOf(active.actionSet)))
                refuse(XR_ERROR_ACTIONSET_NOT_ATTACHED, "the action set is not attached");
            if (active.subactionPath != XR_NULL_PATH)
                rt.requirePath(active.subactionPath);
            synced.insert(idOf(active.actionSet));
        }
        announceProfiles(rt, handle);
        const bool focused = session.state == XR_SESSION_STATE_FOCUSED;
        for (auto& [id, action] : rt.actions.actions)
            for (auto& [user_path, state] : action.states) {
                if (focused && synced.contains(action.set))
                    syncState(rt, action, id, user_path, state);
                else
                    state = {};
            }
        return focused ? XR_SUCCESS : XR_SESSION_NOT_FOCUSED;
    });
}

XrResult xrGetActionStateBoolean(XrSession session, const XrActionStateGetInfo* info, XrActionStateBoolean* out)
{
    return guarded("xrGetActionStateBoolean", [&](Runtime& rt) {
        const ActionState& state = requireState(rt, session, info, XR_ACTION_TYPE_BOOLEAN_INPUT);
        requireType(out, XR_TYPE_ACTION_STATE_BOOLEAN, "state");
        fill(out, state);
        out->currentState = state.value.x > 0.5f ? XR_TRUE : XR_FALSE;
        return XR_SUCCESS;
    });
}

XrResult xrGetActionStateFloat(XrSession session, const XrActionStateGetInfo* info, XrActionStateFloat* out)
{
    return guarded("xrGetActionStateFloat", [&](Runtime& rt) {
        const ActionState& state = requireState(rt, session, info, XR_ACTION_TYPE_FLOAT_INPUT);
        requireType(out, XR_TYPE_ACTION_STATE_FLOAT, "state");
        fill(out, state);
        out->currentState = state.value.x;
        return XR_SUCCESS;
    });
}

XrResult xrGetActionStateVector2f(XrSession session, const XrActionStateGetInfo* info, XrActionStateVector2f* out)
{
    return guarded("xrGetActionStateVector2f", [&](Runtime& rt) {
        const ActionState& state = requireState(rt, session, info, XR_ACTION_TYPE_VECTOR2F_INPUT);
        requireType(out, XR_TYPE_ACTION_STATE_VECTOR2F, "state");
        fill(out, state);
        out->currentState = state.value;
        return XR_SUCCESS;
    });
}

XrResult xrGetActionStatePose(XrSession session, const XrActionStateGetInfo* info, XrActionStatePose* out)
{
    return guarded("xrGetActionStatePose", [&](Runtime& rt) {
        const ActionState& state = requireState(rt, session, info, XR_ACTION_TYPE_POSE_INPUT);
        requireType(out, XR_TYPE_ACTION_STATE_POSE, "state");
        out->isActive = state.active ? XR_TRUE : XR_FALSE;
        return XR_SUCCESS;
    });
}

XrResult xrApplyHapticFeedback(XrSession session, const XrHapticActionInfo* info, const XrHapticBaseHeader* haptic)
{
    return guarded("xrApplyHapticFeedback", [&](Runtime& rt) {
        std::string user_path;
        const Action& action = requireHaptic(rt, session, info, user_path);
        const auto* vibration = reinterpret_cast<const XrHapticVibration*>(haptic);
        requireType(vibration, XR_TYPE_HAPTIC_VIBRATION, "hapticFeedback");
        rt.log.line(formatString(R"({"haptic":"apply","action":"%s","user_path":"%s","duration":%lld,)"
                                 R"("frequency":%.9g,"amplitude":%.9g})",
                                 action.name.c_str(), user_path.c_str(), static_cast<long long>(vibration->duration),
                                 double(vibration->frequency), double(vibration->amplitude)));
        return rt.session->state == XR_SESSION_STATE_FOCUSED ? XR_SUCCESS : XR_SESSION_NOT_FOCUSED;
    });
}

XrResult xrStopHapticFeedback(XrSession session, const XrHapticActionInfo* info)
{
    return guarded("xrStopHapticFeedback", [&](Runtime& rt) {
        std::string user_path;
        const Action& action = requireHaptic(rt, session, info, user_path);
        rt.log.line(formatString(R"({"haptic":"stop","action":"%s","user_path":"%s"})", action.name.c_str(),
                                 user_path.c_str()));
        return rt.session->state == XR_SESSION_STATE_FOCUSED ? XR_SUCCESS : XR_SESSION_NOT_FOCUSED;
    });
}

} // namespace gsc::fake_xr
