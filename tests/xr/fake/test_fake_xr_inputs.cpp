// SPDX-License-Identifier: Apache-2.0
// Controllers, gaze and the smaller extensions of the fake runtime.
#include "probe.h"

#include <doctest/doctest.h>

#include <cmath>
#include <cstring>

namespace gsc::fake_xr {

namespace {

using nlohmann::json;

struct ActionsOfTest {
    explicit ActionsOfTest(Probe& p) : probe(p)
    {
        auto info = xrInfo<XrActionSetCreateInfo>(XR_TYPE_ACTION_SET_CREATE_INFO);
        std::strcpy(info.actionSetName, "all");
        std::strcpy(info.localizedActionSetName, "All");
        must(xrCreateActionSet(probe.instance, &info, &set), "xrCreateActionSet");
    }

    XrAction make(const char* name, XrActionType type, const std::vector<XrPath>& subactions = {})
    {
        auto info = xrInfo<XrActionCreateInfo>(XR_TYPE_ACTION_CREATE_INFO);
        std::strcpy(info.actionName, name);
        std::strcpy(info.localizedActionName, name);
        info.actionType = type;
        info.countSubactionPaths = uint32_t(subactions.size());
        info.subactionPaths = subactions.data();
        XrAction action = XR_NULL_HANDLE;
        must(xrCreateAction(set, &info, &action), "xrCreateAction");
        return action;
    }

    XrResult suggest(const char* profile, const std::vector<std::pair<XrAction, const char*>>& bindings)
    {
        std::vector<XrActionSuggestedBinding> list;
        for (const auto& [action, path] : bindings)
            list.push_back({action, probe.path(path)});
        const XrInteractionProfileSuggestedBinding info{XR_TYPE_INTERACTION_PROFILE_SUGGESTED_BINDING, nullptr,
                                                        probe.path(profile), uint32_t(list.size()), list.data()};
        return xrSuggestInteractionProfileBindings(probe.instance, &info);
    }

    XrResult attach()
    {
        const XrSessionActionSetsAttachInfo info{XR_TYPE_SESSION_ACTION_SETS_ATTACH_INFO, nullptr, 1, &set};
        return xrAttachSessionActionSets(probe.session, &info);
    }

    XrResult sync()
    {
        const XrActiveActionSet active{set, XR_NULL_PATH};
        const XrActionsSyncInfo info{XR_TYPE_ACTIONS_SYNC_INFO, nullptr, 1, &active};
        return xrSyncActions(probe.session, &info);
    }

    XrActionStateBoolean boolean(XrAction action, XrPath user = XR_NULL_PATH)
    {
        auto state = xrInfo<XrActionStateBoolean>(XR_TYPE_ACTION_STATE_BOOLEAN);
        const XrActionStateGetInfo info{XR_TYPE_ACTION_STATE_GET_INFO, nullptr, action, user};
        must(xrGetActionStateBoolean(probe.session, &info, &state), "xrGetActionStateBoolean");
        return state;
    }

    XrActionStateFloat number(XrAction action, XrPath user = XR_NULL_PATH)
    {
        auto state = xrInfo<XrActionStateFloat>(XR_TYPE_ACTION_STATE_FLOAT);
        const XrActionStateGetInfo info{XR_TYPE_ACTION_STATE_GET_INFO, nullptr, action, user};
        must(xrGetActionStateFloat(probe.session, &info, &state), "xrGetActionStateFloat");
        return state;
    }

    XrActionStateVector2f vector(XrAction action, XrPath user = XR_NULL_PATH)
    {
        auto state = xrInfo<XrActionStateVector2f>(XR_TYPE_ACTION_STATE_VECTOR2F);
        const XrActionStateGetInfo info{XR_TYPE_ACTION_STATE_GET_INFO, nullptr, action, user};
        must(xrGetActionStateVector2f(probe.session, &info, &state), "xrGetActionStateVector2f");
        return state;
    }

    bool poseActive(XrAction action, XrPath user = XR_NULL_PATH)
    {
        auto state = xrInfo<XrActionStatePose>(XR_TYPE_ACTION_STATE_POSE);
        const XrActionStateGetInfo info{XR_TYPE_ACTION_STATE_GET_INFO, nullptr, action, user};
        must(xrGetActionStatePose(probe.session, &info, &state), "xrGetActionStatePose");
        return state.isActive;
    }

    XrSpace space(XrAction action, XrPath user = XR_NULL_PATH)
    {
        XrSpace made = XR_NULL_HANDLE;
        const XrActionSpaceCreateInfo info{
            XR_TYPE_ACTION_SPACE_CREATE_INFO, nullptr, action, user, {{0, 0, 0, 1}, {0, 0, 0}}};
        must(xrCreateActionSpace(probe.session, &info, &made), "xrCreateActionSpace");
        return made;
    }

    Probe& probe;
    XrActionSet set = XR_NULL_HANDLE;
};

json input(double t, const char* path, double value)
{
    return {{"t", t}, {"path", path}, {"value", value}};
}

constexpr const char* kTouch = "/interaction_profiles/oculus/touch_controller";

} // namespace

TEST_CASE("controllers: values, poses, profiles and haptics")
{
    const json hand{{{"t", 0}, {"position", {0.2, -0.3, -0.4}}}, {{"t", 1}, {"position", {0.2, -0.3, -1.4}}}};
    Probe probe("controllers", smallViews({{"hands", {{"right", hand}}},
                                           {"inputs",
                                            {input(0.1, "/user/hand/left/input/thumbstick/x", 0.75),
                                             input(0.1, "/user/hand/left/input/thumbstick/y", -0.5),
                                             input(0.2, "/user/hand/left/input/thumbstick/x", 0),
                                             input(0.1, "/user/hand/right/input/trigger/value", 0.25),
                                             input(0.2, "/user/hand/right/input/a/click", 1),
                                             input(0.2, "/user/hand/left/input/squeeze/value", 0.6)}}}));
    start(probe);
    const XrPath left = probe.path("/user/hand/left"), right = probe.path("/user/hand/right");
    ActionsOfTest actions(probe);
    const XrAction move = actions.make("move", XR_ACTION_TYPE_VECTOR2F_INPUT);
    const XrAction pull = actions.make("pull", XR_ACTION_TYPE_FLOAT_INPUT, {left, right});
    const XrAction press = actions.make("press", XR_ACTION_TYPE_BOOLEAN_INPUT);
    const XrAction grab = actions.make("grab", XR_ACTION_TYPE_BOOLEAN_INPUT);
    const XrAction aim = actions.make("aim", XR_ACTION_TYPE_POSE_INPUT, {left, right});
    const XrAction buzz = actions.make("buzz", XR_ACTION_TYPE_VIBRATION_OUTPUT, {left, right});
    CHECK(actions.suggest(kTouch, {{press, "/user/hand/left/input/a/click"}}) == XR_ERROR_PATH_UNSUPPORTED);
    CHECK(actions.suggest("/interaction_profiles/no/such", {{press, "/user/hand/right/input/a/click"}}) ==
          XR_ERROR_PATH_UNSUPPORTED);
    CHECK(actions.suggest(kTouch, {{move, "/user/hand/left/input/thumbstick"},
                                   {pull, "/user/hand/left/input/trigger"},
                                   {pull, "/user/hand/right/input/trigger/value"},
                                   {press, "/user/hand/right/input/a/click"},
                                   {grab, "/user/hand/left/input/squeeze/value"},
                                   {aim, "/user/hand/left/input/aim/pose"},
                                   {aim, "/user/hand/right/input/aim/pose"},
                                   {buzz, "/user/hand/right/output/haptic"}}) == XR_SUCCESS);
    CHECK(actions.suggest("/interaction_profiles/khr/simple_controller",
                          {{move, "/user/hand/left/input/menu/click"}}) == XR_SUCCESS); // and not looked at
    auto unattached = xrInfo<XrActionStateBoolean>(XR_TYPE_ACTION_STATE_BOOLEAN);
    const XrActionStateGetInfo get_press{XR_TYPE_ACTION_STATE_GET_INFO, nullptr, press, XR_NULL_PATH};
    CHECK(xrGetActionStateBoolean(probe.session, &get_press, &unattached) == XR_ERROR_ACTIONSET_NOT_ATTACHED);
    CHECK(actions.attach() == XR_SUCCESS);
    CHECK(actions.attach() == XR_ERROR_ACTIONSETS_ALREADY_ATTACHED);
    CHECK(actions.suggest(kTouch, {{press, "/user/hand/right/input/a/click"}}) == XR_ERROR_ACTIONSETS_ALREADY_ATTACHED);
    CHECK(actions.sync() == XR_SESSION_NOT_FOCUSED);
    CHECK(!actions.number(pull).isActive);
    const XrSpace right_aim = actions.space(aim, right), left_aim = actions.space(aim, left);

    for (int i = 0; i < 25; ++i) {
        CAPTURE(i);
        const Probe::Frame frame = probe.waitAndBegin();
        if (i > 0) {
            CHECK(actions.sync() == XR_SUCCESS);
            const XrActionStateVector2f stick = actions.vector(move);
            CHECK(stick.isActive == XR_TRUE);
            CHECK(stick.currentState.x == (i >= 9 && i < 18 ? 0.75f : 0.0f));
            CHECK(stick.currentState.y == (i >= 9 ? -0.5f : 0.0f));
            CHECK(stick.changedSinceLastSync == (i == 9 || i == 18));
            CHECK((stick.lastChangeTime != 0) == (i >= 9));
            CHECK(actions.number(pull).currentState == (i >= 9 ? 0.25f : 0.0f));
            CHECK(actions.number(pull, right).currentState == (i >= 9 ? 0.25f : 0.0f));
            CHECK(actions.number(pull, left).currentState == 0);
            CHECK(actions.boolean(press).currentState == (i >= 18));
            CHECK(actions.boolean(press).changedSinceLastSync == (i == 18));
            CHECK(actions.boolean(grab).currentState == (i >= 18));
            CHECK(actions.poseActive(aim, right));
            CHECK(!actions.poseActive(aim, left)); // its controller has buttons, and no pose in the settings
            auto location = xrInfo<XrSpaceLocation>(XR_TYPE_SPACE_LOCATION);
            const XrTime time = frame.state.predictedDisplayTime;
            CHECK(xrLocateSpace(right_aim, probe.local, time, &location) == XR_SUCCESS);
            CHECK(location.locationFlags == 15);
            CHECK(location.pose.position.z == doctest::Approx(-0.4 - i / 90.0));
            CHECK(xrLocateSpace(left_aim, probe.local, time, &location) == XR_SUCCESS);
            CHECK(location.locationFlags == 0);
        }
        must(probe.end(frame), "xrEndFrame");
    }
    auto profile = xrInfo<XrInteractionProfileState>(XR_TYPE_INTERACTION_PROFILE_STATE);
    CHECK(xrGetCurrentInteractionProfile(probe.session, right, &profile) == XR_SUCCESS);
    CHECK(profile.interactionProfile == probe.path(kTouch));
    probe.readStates();
    CHECK(probe.other_events == std::vector{XR_TYPE_EVENT_DATA_INTERACTION_PROFILE_CHANGED});

    auto vibration = xrInfo<XrHapticVibration>(XR_TYPE_HAPTIC_VIBRATION);
    vibration.duration = 50'000'000;
    vibration.amplitude = 0.5f;
    const XrHapticActionInfo haptic{XR_TYPE_HAPTIC_ACTION_INFO, nullptr, buzz, right};
    CHECK(xrApplyHapticFeedback(probe.session, &haptic, reinterpret_cast<XrHapticBaseHeader*>(&vibration)) ==
          XR_SUCCESS);
    CHECK(xrStopHapticFeedback(probe.session, &haptic) == XR_SUCCESS);
    const json line = probe.logged("haptic")[0];
    CHECK(line["action"] == "buzz");
    CHECK(line["user_path"] == "/user/hand/right");
    CHECK(line["amplitude"] == 0.5);
    auto wrong = xrInfo<XrActionStateFloat>(XR_TYPE_ACTION_STATE_FLOAT);
    CHECK(xrGetActionStateFloat(probe.session, &get_press, &wrong) == XR_ERROR_ACTION_TYPE_MISMATCH);
    const XrActionStateGetInfo get_left{XR_TYPE_ACTION_STATE_GET_INFO, nullptr, press, left};
    CHECK(xrGetActionStateBoolean(probe.session, &get_left, &unattached) == XR_ERROR_PATH_UNSUPPORTED);
}

TEST_CASE("gaze turns with the head")
{
    const double half = std::sqrt(0.5), c = std::cos(0.1), s = std::sin(0.1);
    Probe probe("gaze",
                smallViews({{"head", {{{"t", 0}, {"position", {1, 0, 0}}, {"rotation", {0, half, 0, half}}}}},
                            {"gaze", {{{"t", 0}, {"rotation", {s, 0, 0, c}}}}},
                            {"tracking_lost", {{0.1, 0.2}}}}),
                {XR_EXT_EYE_GAZE_INTERACTION_EXTENSION_NAME});
    auto supports = xrInfo<XrSystemEyeGazeInteractionPropertiesEXT>(XR_TYPE_SYSTEM_EYE_GAZE_INTERACTION_PROPERTIES_EXT);
    auto properties = xrInfo<XrSystemProperties>(XR_TYPE_SYSTEM_PROPERTIES, &supports);
    must(xrGetSystemProperties(probe.instance, probe.system, &properties), "xrGetSystemProperties");
    CHECK(supports.supportsEyeGazeInteraction == XR_TRUE);
    start(probe);
    ActionsOfTest actions(probe);
    const XrAction gaze = actions.make("gaze", XR_ACTION_TYPE_POSE_INPUT);
    CHECK(actions.suggest("/interaction_profiles/ext/eye_gaze_interaction",
                          {{gaze, "/user/eyes_ext/input/gaze_ext/pose"}}) == XR_SUCCESS);
    CHECK(actions.attach() == XR_SUCCESS);
    const XrSpace space = actions.space(gaze);
    for (int i = 0; i < 20; ++i) {
        CAPTURE(i);
        const Probe::Frame frame = probe.waitAndBegin();
        actions.sync();
        auto sample = xrInfo<XrEyeGazeSampleTimeEXT>(XR_TYPE_EYE_GAZE_SAMPLE_TIME_EXT);
        auto location = xrInfo<XrSpaceLocation>(XR_TYPE_SPACE_LOCATION, &sample);
        const XrTime time = frame.state.predictedDisplayTime;
        must(xrLocateSpace(space, probe.local, time, &location), "xrLocateSpace");
        const bool found = i > 0 && (i < 9 || i >= 18);
        CHECK(location.locationFlags == (found ? 15u : 0u));
        CHECK(sample.time == (found ? time : 0));
        CHECK(actions.poseActive(gaze) == (i > 0));
        if (found) {
            CHECK(location.pose.position.x == 1);
            CHECK(location.pose.orientation.x == doctest::Approx(half * s));
            CHECK(location.pose.orientation.y == doctest::Approx(half * c));
            CHECK(location.pose.orientation.z == doctest::Approx(-half * s));
            CHECK(location.pose.orientation.w == doctest::Approx(half * c));
        }
        must(probe.end(frame), "xrEndFrame");
    }
}

TEST_CASE("visibility masks are those of the settings")
{
    const json mask{{"1", {{"vertices", {{-1, -1}, {-1, 1}, {0, 0.5}}}, {"indices", {0, 1, 2}}}}};
    Probe probe("mask", smallViews({{"visibility_mask", mask}}), {XR_KHR_VISIBILITY_MASK_EXTENSION_NAME});
    probe.openSession();
    const auto get = probe.load<PFN_xrGetVisibilityMaskKHR>("xrGetVisibilityMaskKHR");
    auto out = xrInfo<XrVisibilityMaskKHR>(XR_TYPE_VISIBILITY_MASK_KHR);
    const auto hidden = XR_VISIBILITY_MASK_TYPE_HIDDEN_TRIANGLE_MESH_KHR;
    CHECK(get(probe.session, probe.configuration, 0, hidden, &out) == XR_SUCCESS);
    CHECK(out.vertexCountOutput == 0);
    CHECK(get(probe.session, probe.configuration, 1, hidden, &out) == XR_SUCCESS);
    CHECK(out.vertexCountOutput == 3);
    CHECK(out.indexCountOutput == 3);
    std::vector<XrVector2f> vertices(3);
    std::vector<uint32_t> indices(3);
    out.vertexCapacityInput = out.indexCapacityInput = 3;
    out.vertices = vertices.data();
    out.indices = indices.data();
    CHECK(get(probe.session, probe.configuration, 1, hidden, &out) == XR_SUCCESS);
    CHECK(vertices[2].y == 0.5f);
    CHECK(indices == std::vector<uint32_t>{0, 1, 2});
    CHECK(get(probe.session, probe.configuration, 2, hidden, &out) == XR_ERROR_VALIDATION_FAILURE);
    CHECK(probe.logged("visibility_mask").back() ==
          json{{"visibility_mask", 1}, {"hidden", true}, {"vertices", 3}, {"indices", 3}});
}

TEST_CASE("a visibility mask changes with an event")
{
    const json mask{{"1", {{"vertices", {{-1, -1}, {-1, 1}, {0, 0.5}}}, {"indices", {0, 1, 2}}}}};
    const json events{{{"frame", 3}, {"do", "mask"}, {"masks", mask}}};
    Probe probe("mask_changes", smallViews({{"visibility_mask", json::object()}, {"events", events}}),
                {XR_KHR_VISIBILITY_MASK_EXTENSION_NAME});
    start(probe);
    const auto get = probe.load<PFN_xrGetVisibilityMaskKHR>("xrGetVisibilityMaskKHR");
    for (int i = 0; i < 5; ++i) {
        probe.runFrame();
        (void)probe.readStates();
        auto out = xrInfo<XrVisibilityMaskKHR>(XR_TYPE_VISIBILITY_MASK_KHR);
        must(get(probe.session, probe.configuration, 1, XR_VISIBILITY_MASK_TYPE_HIDDEN_TRIANGLE_MESH_KHR, &out),
             "xrGetVisibilityMaskKHR");
        CHECK(out.indexCountOutput == (i < 3 ? 0 : 3));
    }
    CHECK(probe.other_events == std::vector{XR_TYPE_EVENT_DATA_VISIBILITY_MASK_CHANGED_KHR});
    CHECK(probe.logged("event").back() == json{{"event", "visibility_mask_changed"}, {"view", 1}, {"frame", 3}});
}

TEST_CASE("visibility masks are offered where the settings have some")
{
    CHECK_THROWS(Probe("no_masks", smallViews(), {XR_KHR_VISIBILITY_MASK_EXTENSION_NAME}));
}

} // namespace gsc::fake_xr
