// SPDX-License-Identifier: Apache-2.0
#include "functions.h"
#include "system.h"

#include <cmath>

namespace gsc::fake_xr {

namespace {

constexpr size_t kRemembered = 4096; // views; a renderer that is further behind has other worries

constexpr XrSpaceLocationFlags kTracked =
    XR_SPACE_LOCATION_ORIENTATION_VALID_BIT | XR_SPACE_LOCATION_POSITION_VALID_BIT |
    XR_SPACE_LOCATION_ORIENTATION_TRACKED_BIT | XR_SPACE_LOCATION_POSITION_TRACKED_BIT;

// No rotation at all: an application that draws with a pose without looking at the flags is found out in xrEndFrame.
constexpr XrPosef kInvalid{{0, 0, 0, 0}, {0, 0, 0}};

void requireTime(XrTime time)
{
    if (time <= 0)
        refuse(XR_ERROR_TIME_INVALID, formatString("time %lld, expected more than 0", static_cast<long long>(time)));
}

void requirePose(const XrPosef& pose, const char* name)
{
    const XrVector3f& p = pose.position;
    if (!isUnit(pose.orientation) || !std::isfinite(p.x + p.y + p.z))
        refuse(XR_ERROR_POSE_INVALID, std::string(name) + " has no unit quaternion or no finite position");
}

bool isView(const Space& space)
{
    return space.reference == XR_REFERENCE_SPACE_TYPE_VIEW;
}

// The pose of a space in LOCAL; none while it is not tracked.
std::optional<XrPosef> inLocal(Runtime& rt, const Space& space, XrTime time)
{
    XrPosef origin = kIdentity;
    const double t = rt.scriptTime(time);
    if (!space.reference) {
        if (!locateAction(rt, space.action, space.user_path, time, origin))
            return std::nullopt;
    } else if (isView(space)) {
        if (!trackedAt(rt.settings, t))
            return std::nullopt;
        origin = headAt(rt.settings, t);
    } else if (space.reference == XR_REFERENCE_SPACE_TYPE_STAGE) {
        origin.position.y = -rt.settings.floor;
    }
    return origin * space.offset;
}

std::vector<XrReferenceSpaceType> referenceSpaces(const Settings& settings)
{
    std::vector<XrReferenceSpaceType> types{XR_REFERENCE_SPACE_TYPE_VIEW, XR_REFERENCE_SPACE_TYPE_LOCAL};
    if (settings.stage)
        types.push_back(XR_REFERENCE_SPACE_TYPE_STAGE);
    return types;
}

void requireReference(const Runtime& rt, XrReferenceSpaceType type)
{
    const std::vector<XrReferenceSpaceType> offered = referenceSpaces(rt.settings);
    if (std::find(offered.begin(), offered.end(), type) == offered.end())
        refuse(XR_ERROR_REFERENCE_SPACE_UNSUPPORTED, formatString("reference space %d", type));
}

XrSpace addSpace(Runtime& rt, Session& session, const Space& space)
{
    const uint64_t id = rt.next_id++;
    session.spaces[id] = space;
    return handleOf<XrSpace>(id);
}

void remember(Session& session, uint32_t view, const LocatedView& located)
{
    std::deque<LocatedView>& list = session.located[view];
    list.push_back(located);
    if (list.size() > kRemembered)
        list.pop_front();
}

} // namespace

XrResult xrEnumerateReferenceSpaces(XrSession session, uint32_t capacity, uint32_t* count, XrReferenceSpaceType* out)
{
    return guarded("xrEnumerateReferenceSpaces", [&](Runtime& rt) {
        rt.requireSession(session);
        return listOut(referenceSpaces(rt.settings), capacity, count, out);
    });
}

XrResult xrCreateReferenceSpace(XrSession handle, const XrReferenceSpaceCreateInfo* info, XrSpace* out)
{
    return guarded("xrCreateReferenceSpace", [&](Runtime& rt) {
        Session& session = rt.requireSession(handle);
        requireType(info, XR_TYPE_REFERENCE_SPACE_CREATE_INFO, "createInfo");
        requirePointer(out, "space");
        requireReference(rt, info->referenceSpaceType);
        requirePose(info->poseInReferenceSpace, "poseInReferenceSpace");
        *out = addSpace(rt, session, {info->referenceSpaceType, 0, {}, info->poseInReferenceSpace});
        return XR_SUCCESS;
    });
}

XrResult xrCreateActionSpace(XrSession handle, const XrActionSpaceCreateInfo* info, XrSpace* out)
{
    return guarded("xrCreateActionSpace", [&](Runtime& rt) {
        Session& session = rt.requireSession(handle);
        requireType(info, XR_TYPE_ACTION_SPACE_CREATE_INFO, "createInfo");
        requirePointer(out, "space");
        const auto action = rt.actions.actions.find(idOf(info->action));
        if (action == rt.actions.actions.end())
            refuse(XR_ERROR_HANDLE_INVALID, "no such action");
        if (action->second.type != XR_ACTION_TYPE_POSE_INPUT)
            refuse(XR_ERROR_ACTION_TYPE_MISMATCH, action->second.name + " is no pose action");
        requirePose(info->poseInActionSpace, "poseInActionSpace");
        std::string user_path;
        if (info->subactionPath != XR_NULL_PATH) {
            user_path = rt.requirePath(info->subactionPath);
            const std::vector<std::string>& known = action->second.subactions;
            if (std::find(known.begin(), known.end(), user_path) == known.end())
                refuse(XR_ERROR_PATH_UNSUPPORTED, user_path + " is no subaction path of " + action->second.name);
        }
        *out = addSpace(rt, session, {std::nullopt, action->first, user_path, info->poseInActionSpace});
        return XR_SUCCESS;
    });
}

XrResult xrGetReferenceSpaceBoundsRect(XrSession session, XrReferenceSpaceType type, XrExtent2Df* out)
{
    return guarded("xrGetReferenceSpaceBoundsRect", [&](Runtime& rt) {
        rt.requireSession(session);
        requireReference(rt, type);
        requirePointer(out, "bounds");
        *out = {0, 0};
        return XR_SPACE_BOUNDS_UNAVAILABLE;
    });
}

XrResult xrDestroySpace(XrSpace handle)
{
    return guarded("xrDestroySpace", WhenLost::Work, [&](Runtime& rt) {
        if (!rt.session || rt.session->spaces.erase(idOf(handle)) == 0)
            refuse(XR_ERROR_HANDLE_INVALID, "no such space");
        return XR_SUCCESS;
    });
}

XrResult xrLocateSpace(XrSpace space_handle, XrSpace base_handle, XrTime time, XrSpaceLocation* out)
{
    return guarded("xrLocateSpace", [&](Runtime& rt) {
        const Space& space = rt.requireSpace(space_handle);
        const Space& base = rt.requireSpace(base_handle);
        requireType(out, XR_TYPE_SPACE_LOCATION, "location");
        requireTime(time);
        const std::optional<XrPosef> from = inLocal(rt, base, time), to = inLocal(rt, space, time);
        out->locationFlags = from && to ? kTracked : 0;
        out->pose = from && to ? inverse(*from) * *to : kInvalid;
        if (auto* velocity = chainedOut<XrSpaceVelocity>(out->next, XR_TYPE_SPACE_VELOCITY)) {
            velocity->velocityFlags = 0;
            velocity->linearVelocity = velocity->angularVelocity = {0, 0, 0};
        }
        if (auto* sample = chainedOut<XrEyeGazeSampleTimeEXT>(out->next, XR_TYPE_EYE_GAZE_SAMPLE_TIME_EXT))
            sample->time = from && to ? time : 0;
        return XR_SUCCESS;
    });
}

XrResult xrLocateViews(XrSession handle, const XrViewLocateInfo* info, XrViewState* state, uint32_t capacity,
                       uint32_t* count, XrView* out)
{
    return guarded("xrLocateViews", [&](Runtime& rt) {
        Session& session = rt.requireSession(handle);
        requireType(info, XR_TYPE_VIEW_LOCATE_INFO, "viewLocateInfo");
        requireType(state, XR_TYPE_VIEW_STATE, "viewState");
        const uint32_t views = requireConfiguration(rt, info->viewConfigurationType);
        requireTime(info->displayTime);
        const Space& space = rt.requireSpace(info->space);
        const std::optional<XrPosef> base = inLocal(rt, space, info->displayTime);
        const double t = rt.scriptTime(info->displayTime);
        const bool tracked = base && trackedAt(rt.settings, t);
        std::vector<XrView> located;
        for (uint32_t i = 0; i < views; ++i) {
            const ViewSettings& view = rt.settings.views[i];
            if (out != nullptr && i < capacity)
                requireType(&out[i], XR_TYPE_VIEW, "views");
            const XrPosef pose = tracked ? inverse(*base) * (headAt(rt.settings, t) * view.eye) : kInvalid;
            located.push_back({XR_TYPE_VIEW, out != nullptr && i < capacity ? out[i].next : nullptr, pose, view.fov});
        }
        state->viewStateFlags = tracked ? XrViewStateFlags(kTracked) : 0; // the two have the same bits
        const XrResult result = listOut(located, capacity, count, out);
        for (uint32_t i = 0; i < views && capacity > 0 && tracked; ++i)
            remember(session, i,
                     {located[i].pose, located[i].fov, idOf(info->space), rt.frames - 1, info->displayTime});
        return result;
    });
}

} // namespace gsc::fake_xr
