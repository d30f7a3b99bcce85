// SPDX-License-Identifier: Apache-2.0
#include "functions.h"
#include "runtime.h"

namespace gsc::fake_xr {

namespace {

constexpr const char* kGazeProfile = "/interaction_profiles/ext/eye_gaze_interaction";
constexpr const char* kEyes = "/user/eyes_ext";

ActionSet& requireSet(Runtime& rt, XrActionSet handle)
{
    const auto found = rt.actions.sets.find(idOf(handle));
    if (found == rt.actions.sets.end())
        refuse(XR_ERROR_HANDLE_INVALID, "no such action set");
    return found->second;
}

void checkName(const char* name, const char* localized)
{
    const std::string text = name;
    const auto allowed = [](char c) {
        return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '-' || c == '_' || c == '.';
    };
    if (text.empty())
        refuse(XR_ERROR_NAME_INVALID, "a name is empty");
    if (!std::all_of(text.begin(), text.end(), allowed))
        refuse(XR_ERROR_PATH_FORMAT_INVALID, "the name \"" + text + "\" has a character that paths do not have");
    if (*localized == '\0')
        refuse(XR_ERROR_LOCALIZED_NAME_INVALID, text + " has no localized name");
}

void checkSuggestion(Runtime& rt, const std::string& profile, const XrActionSuggestedBinding& binding)
{
    const auto action = rt.actions.actions.find(idOf(binding.action));
    if (action == rt.actions.actions.end())
        refuse(XR_ERROR_HANDLE_INVALID, "a suggested binding has no such action");
    if (rt.actions.sets.at(action->second.set).attached)
        refuse(XR_ERROR_ACTIONSETS_ALREADY_ATTACHED, "the set of " + action->second.name + " is attached already");
    const std::string path = rt.requirePath(binding.binding);
    if (!profileHas(profile, path))
        refuse(XR_ERROR_PATH_UNSUPPORTED, profile + " has no " + path);
}

} // namespace

bool deviceActive(const Runtime& rt, const std::string& user_path)
{
    const Settings& s = rt.settings;
    if (user_path == kEyes)
        return !s.gaze.empty() && rt.enabled(XR_EXT_EYE_GAZE_INTERACTION_EXTENSION_NAME);
    const auto below = [&](const InputKey& key) { return key.path.starts_with(user_path + "/"); };
    return s.hands.contains(user_path) || std::any_of(s.inputs.begin(), s.inputs.end(), below);
}

std::string currentProfile(const Runtime& rt, const std::string& user_path)
{
    const std::string profile = user_path == kEyes ? kGazeProfile : rt.settings.profile;
    return deviceActive(rt, user_path) && rt.actions.suggested.contains(profile) ? profile : "";
}

std::vector<std::string> boundPaths(const Runtime& rt, uint64_t action, const std::string& user_path)
{
    std::vector<std::string> paths;
    for (const auto& [profile, bindings] : rt.actions.suggested)
        for (const Binding& binding : bindings) {
            const std::string user = userPathOf(binding.path);
            if (binding.action == action && currentProfile(rt, user) == profile &&
                (user_path.empty() || user == user_path))
                paths.push_back(binding.path);
        }
    return paths;
}

bool locateAction(Runtime& rt, uint64_t action, const std::string& user_path, XrTime time, XrPosef& pose)
{
    const double t = rt.scriptTime(time);
    const auto found = rt.actions.actions.find(action);
    // as of the last xrSyncActions: without the focus, or before the first, nothing is active
    if (found == rt.actions.actions.end() || !found->second.states[user_path].active || !trackedAt(rt.settings, t))
        return false;
    for (const std::string& path : boundPaths(rt, action, user_path)) {
        const std::string user = userPathOf(path);
        if (user == kEyes) {
            pose = headAt(rt.settings, t) * poseAt(rt.settings.gaze, t);
            return true;
        }
        if (const auto hand = rt.settings.hands.find(user); hand != rt.settings.hands.end() && !hand->second.empty()) {
            pose = poseAt(hand->second, t);
            return true;
        }
    }
    return false;
}

XrResult xrCreateActionSet(XrInstance instance, const XrActionSetCreateInfo* info, XrActionSet* out)
{
    return guarded("xrCreateActionSet", [&](Runtime& rt) {
        rt.requireInstance(instance);
        requireType(info, XR_TYPE_ACTION_SET_CREATE_INFO, "createInfo");
        requirePointer(out, "actionSet");
        checkName(info->actionSetName, info->localizedActionSetName);
        for (const auto& [id, set] : rt.actions.sets)
            if (set.name == info->actionSetName)
                refuse(XR_ERROR_NAME_DUPLICATED, set.name + " is there already");
        const uint64_t id = rt.next_id++;
        rt.actions.sets[id] = {info->actionSetName};
        *out = handleOf<XrActionSet>(id);
        return XR_SUCCESS;
    });
}

XrResult xrDestroyActionSet(XrActionSet handle)
{
    return guarded("xrDestroyActionSet", WhenLost::Work, [&](Runtime& rt) {
        requireSet(rt, handle);
        rt.actions.sets.erase(idOf(handle));
        rt.actions.attached.erase(idOf(handle));
        std::erase_if(rt.actions.actions, [&](const auto& item) { return item.second.set == idOf(handle); });
        return XR_SUCCESS;
    });
}

XrResult xrCreateAction(XrActionSet handle, const XrActionCreateInfo* info, XrAction* out)
{
    return guarded("xrCreateAction", [&](Runtime& rt) {
        const ActionSet& set = requireSet(rt, handle);
        requireType(info, XR_TYPE_ACTION_CREATE_INFO, "createInfo");
        requirePointer(out, "action");
        if (set.attached)
            refuse(XR_ERROR_ACTIONSETS_ALREADY_ATTACHED, set.name + " is attached already");
        checkName(info->actionName, info->localizedActionName);
        for (const auto& [id, action] : rt.actions.actions)
            if (action.set == idOf(handle) && action.name == info->actionName)
                refuse(XR_ERROR_NAME_DUPLICATED, action.name + " is there already");
        Action action{idOf(handle), info->actionType, info->actionName, {}, {{"", {}}}};
        for (uint32_t i = 0; i < info->countSubactionPaths; ++i) {
            const std::string path = rt.requirePath(info->subactionPaths[i]);
            if (userPathOf(path) != path)
                refuse(XR_ERROR_PATH_UNSUPPORTED, path + " is no subaction path");
            action.subactions.push_back(path);
            action.states[path] = {};
        }
        const uint64_t id = rt.next_id++;
        rt.actions.actions[id] = std::move(action);
        *out = handleOf<XrAction>(id);
        return XR_SUCCESS;
    });
}

XrResult xrDestroyAction(XrAction handle)
{
    return guarded("xrDestroyAction", WhenLost::Work, [&](Runtime& rt) {
        if (rt.actions.actions.erase(idOf(handle)) == 0)
            refuse(XR_ERROR_HANDLE_INVALID, "no such action");
        return XR_SUCCESS;
    });
}

XrResult xrSuggestInteractionProfileBindings(XrInstance instance, const XrInteractionProfileSuggestedBinding* info)
{
    return guarded("xrSuggestInteractionProfileBindings", [&](Runtime& rt) {
        rt.requireInstance(instance);
        requireType(info, XR_TYPE_INTERACTION_PROFILE_SUGGESTED_BINDING, "suggestedBindings");
        const std::string profile = rt.requirePath(info->interactionProfile);
        const bool gaze = profile == kGazeProfile;
        if (!profileKnown(profile) || (gaze && !rt.enabled(XR_EXT_EYE_GAZE_INTERACTION_EXTENSION_NAME)))
            refuse(XR_ERROR_PATH_UNSUPPORTED, "no interaction profile " + profile);
        if (info->countSuggestedBindings == 0 || info->suggestedBindings == nullptr)
            refuse(XR_ERROR_VALIDATION_FAILURE, "no bindings are suggested");
        std::vector<Binding> bindings;
        for (uint32_t i = 0; i < info->countSuggestedBindings; ++i) {
            const XrActionSuggestedBinding& each = info->suggestedBindings[i];
            checkSuggestion(rt, profile, each);
            bindings.push_back({idOf(each.action), rt.requirePath(each.binding)});
        }
        rt.actions.suggested[profile] = std::move(bindings); // in place of the ones before
        return XR_SUCCESS;
    });
}

XrResult xrAttachSessionActionSets(XrSession session, const XrSessionActionSetsAttachInfo* info)
{
    return guarded("xrAttachSessionActionSets", [&](Runtime& rt) {
        rt.requireSession(session);
        requireType(info, XR_TYPE_SESSION_ACTION_SETS_ATTACH_INFO, "attachInfo");
        if (!rt.actions.attached.empty())
            refuse(XR_ERROR_ACTIONSETS_ALREADY_ATTACHED, "the session has action sets already");
        if (info->countActionSets == 0 || info->actionSets == nullptr)
            refuse(XR_ERROR_VALIDATION_FAILURE, "no action sets");
        for (uint32_t i = 0; i < info->countActionSets; ++i)
            requireSet(rt, info->actionSets[i]);
        for (uint32_t i = 0; i < info->countActionSets; ++i) {
            requireSet(rt, info->actionSets[i]).attached = true;
            rt.actions.attached.insert(idOf(info->actionSets[i]));
        }
        return XR_SUCCESS;
    });
}

XrResult xrGetCurrentInteractionProfile(XrSession session, XrPath user, XrInteractionProfileState* out)
{
    return guarded("xrGetCurrentInteractionProfile", [&](Runtime& rt) {
        rt.requireSession(session);
        requireType(out, XR_TYPE_INTERACTION_PROFILE_STATE, "interactionProfile");
        if (rt.actions.attached.empty())
            refuse(XR_ERROR_ACTIONSET_NOT_ATTACHED, "the session has no action sets");
        const std::string path = rt.requirePath(user);
        if (userPathOf(path) != path)
            refuse(XR_ERROR_PATH_UNSUPPORTED, path + " is no top-level user path");
        // none before the first xrSyncActions, which announces it
        const std::string profile = rt.actions.profile_announced ? currentProfile(rt, path) : "";
        out->interactionProfile = profile.empty() ? XR_NULL_PATH : rt.pathOf(profile);
        return XR_SUCCESS;
    });
}

XrResult xrEnumerateBoundSourcesForAction(XrSession session, const XrBoundSourcesForActionEnumerateInfo* info,
                                          uint32_t capacity, uint32_t* count, XrPath* out)
{
    return guarded("xrEnumerateBoundSourcesForAction", [&](Runtime& rt) {
        rt.requireSession(session);
        requireType(info, XR_TYPE_BOUND_SOURCES_FOR_ACTION_ENUMERATE_INFO, "enumerateInfo");
        const auto action = rt.actions.actions.find(idOf(info->action));
        if (action == rt.actions.actions.end())
            refuse(XR_ERROR_HANDLE_INVALID, "no such action");
        if (!rt.actions.attached.contains(action->second.set))
            refuse(XR_ERROR_ACTIONSET_NOT_ATTACHED, "the action's set is not attached");
        std::vector<XrPath> sources;
        for (const std::string& path : boundPaths(rt, action->first, ""))
            sources.push_back(rt.pathOf(path));
        return listOut(sources, capacity, count, out);
    });
}

XrResult xrGetInputSourceLocalizedName(XrSession session, const XrInputSourceLocalizedNameGetInfo* info,
                                       uint32_t capacity, uint32_t* count, char* out)
{
    return guarded("xrGetInputSourceLocalizedName", [&](Runtime& rt) {
        rt.requireSession(session);
        requireType(info, XR_TYPE_INPUT_SOURCE_LOCALIZED_NAME_GET_INFO, "getInfo");
        if (rt.actions.attached.empty())
            refuse(XR_ERROR_ACTIONSET_NOT_ATTACHED, "the session has no action sets");
        std::string name = rt.requirePath(info->sourcePath);
        name.push_back('\0');
        return listOut(name, capacity, count, out);
    });
}

} // namespace gsc::fake_xr
