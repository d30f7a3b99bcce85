// SPDX-License-Identifier: Apache-2.0
#include "player/present/headset/xr_call.h"

#include <gsc/error.h>

namespace gsc {

void checkXr(XrResult result, const char* what)
{
    if (XR_SUCCEEDED(result))
        return;
    switch (result) {
    case XR_ERROR_RUNTIME_UNAVAILABLE:
        throw Error(ErrorCode::Unsupported, "headset",
                    formatString("no OpenXR runtime answers (%s, code %d)", what, int(result)), "one that runs",
                    "start SteamVR, Monado or WiVRn, or name its manifest in XR_RUNTIME_JSON");
    case XR_ERROR_FORM_FACTOR_UNAVAILABLE:
    case XR_ERROR_FORM_FACTOR_UNSUPPORTED:
        throw Error(ErrorCode::Unsupported, "headset",
                    formatString("the OpenXR runtime finds none (code %d)", int(result)), "one",
                    "connect it and switch it on");
    case XR_ERROR_INSTANCE_LOST:
    case XR_ERROR_SESSION_LOST:
        throw Error(ErrorCode::Device, "headset",
                    formatString("%s: the OpenXR runtime has gone (code %d)", what, int(result)), "that it stays",
                    "start it and the player again");
    default:
        throw Error(ErrorCode::Device, "headset", formatString("%s failed with OpenXR's code %d", what, int(result)),
                    "success", "start the runtime and the player again");
    }
}

void checkXrStart(XrResult result, const char* what)
{
    checkXr(result == XR_ERROR_RUNTIME_FAILURE ? XR_ERROR_RUNTIME_UNAVAILABLE : result, what);
}

SpacePose poseOf(const XrPosef& pose)
{
    const XrVector3f& p = pose.position;
    const XrQuaternionf& q = pose.orientation;
    return {{p.x, p.y, p.z}, {q.w, q.x, q.y, q.z}};
}

XrPosef xrPose(const SpacePose& pose)
{
    XrPosef out;
    out.position = {float(pose.position.x), float(pose.position.y), float(pose.position.z)};
    out.orientation = {float(pose.rotation.x), float(pose.rotation.y), float(pose.rotation.z), float(pose.rotation.w)};
    return out;
}

} // namespace gsc
