// SPDX-License-Identifier: Apache-2.0
// Mistakes of an application: each has to come back as OpenXR's code, with a line in the log.
#include "probe.h"

#include <doctest/doctest.h>

#include <cmath>
#include <cstdlib>
#include <cstring>
#include <fstream>

namespace gsc::fake_xr {

namespace {

using nlohmann::json;

void checkLogged(const Probe& probe, XrResult result, XrResult expected, const char* function)
{
    CHECK(result == expected);
    const std::vector<json> errors = probe.logged("error");
    REQUIRE(!errors.empty());
    CHECK(errors.back()["error"] == int(expected));
    CHECK(errors.back()["function"] == function);
    CHECK(!errors.back()["why"].get<std::string>().empty());
}

using Views = std::vector<XrCompositionLayerProjectionView>;

XrResult createInstance(std::vector<const char*> extensions, XrInstance* out, XrVersion version)
{
    auto info = xrInfo<XrInstanceCreateInfo>(XR_TYPE_INSTANCE_CREATE_INFO);
    std::strcpy(info.applicationInfo.applicationName, "test_fake_xr");
    info.applicationInfo.apiVersion = version;
    info.enabledExtensionCount = uint32_t(extensions.size());
    info.enabledExtensionNames = extensions.data();
    return xrCreateInstance(&info, out);
}

bool offered(const char* name)
{
    uint32_t count = 0;
    must(xrEnumerateInstanceExtensionProperties(nullptr, 0, &count, nullptr), "the extensions");
    std::vector<XrExtensionProperties> list(count, xrInfo<XrExtensionProperties>(XR_TYPE_EXTENSION_PROPERTIES));
    must(xrEnumerateInstanceExtensionProperties(nullptr, count, &count, list.data()), "the extensions");
    return std::any_of(list.begin(), list.end(),
                       [&](const auto& e) { return std::strcmp(e.extensionName, name) == 0; });
}

void useSettings(const std::string& text)
{
    std::ofstream("fake_xr_settings.json") << text;
    setenv("GSC_FAKE_XR", "fake_xr_settings.json", 1);
}

} // namespace

TEST_CASE("calls in the wrong order")
{
    Probe probe("order", smallViews({{"blocked_ms", 20}}));
    XrSessionCreateInfo create{XR_TYPE_SESSION_CREATE_INFO, &probe.binding, 0, probe.system};
    XrSession session = XR_NULL_HANDLE;
    checkLogged(probe, xrCreateSession(probe.instance, &create, &session), XR_ERROR_GRAPHICS_REQUIREMENTS_CALL_MISSING,
                "xrCreateSession");
    create.next = nullptr;
    checkLogged(probe, xrCreateSession(probe.instance, &create, &session), XR_ERROR_GRAPHICS_DEVICE_INVALID,
                "xrCreateSession");
    probe.openSession();
    probe.openSwapchains();
    checkLogged(probe, xrCreateSession(probe.instance, &create, &session), XR_ERROR_LIMIT_REACHED, "xrCreateSession");
    auto state = xrInfo<XrFrameState>(XR_TYPE_FRAME_STATE);
    const XrFrameEndInfo empty{XR_TYPE_FRAME_END_INFO, nullptr, 1, XR_ENVIRONMENT_BLEND_MODE_OPAQUE, 0, nullptr};
    checkLogged(probe, xrWaitFrame(probe.session, nullptr, &state), XR_ERROR_SESSION_NOT_RUNNING, "xrWaitFrame");
    checkLogged(probe, xrBeginFrame(probe.session, nullptr), XR_ERROR_SESSION_NOT_RUNNING, "xrBeginFrame");
    checkLogged(probe, xrEndFrame(probe.session, &empty), XR_ERROR_SESSION_NOT_RUNNING, "xrEndFrame");
    checkLogged(probe, xrEndSession(probe.session), XR_ERROR_SESSION_NOT_RUNNING, "xrEndSession");
    probe.begin();
    const XrSessionBeginInfo again{XR_TYPE_SESSION_BEGIN_INFO, nullptr, probe.configuration};
    checkLogged(probe, xrBeginSession(probe.session, &again), XR_ERROR_SESSION_RUNNING, "xrBeginSession");
    checkLogged(probe, xrBeginFrame(probe.session, nullptr), XR_ERROR_CALL_ORDER_INVALID, "xrBeginFrame");
    checkLogged(probe, xrEndFrame(probe.session, &empty), XR_ERROR_CALL_ORDER_INVALID, "xrEndFrame");
    must(xrWaitFrame(probe.session, nullptr, &state), "xrWaitFrame");
    checkLogged(probe, xrEndFrame(probe.session, &empty), XR_ERROR_CALL_ORDER_INVALID, "xrEndFrame");
    checkLogged(probe, xrWaitFrame(probe.session, nullptr, &state), XR_ERROR_CALL_ORDER_INVALID, "xrWaitFrame");

    const XrSwapchain swapchain = probe.swapchains[0].handle;
    const XrSwapchainImageWaitInfo wait{XR_TYPE_SWAPCHAIN_IMAGE_WAIT_INFO, nullptr, XR_INFINITE_DURATION};
    uint32_t index = 0;
    checkLogged(probe, xrWaitSwapchainImage(swapchain, &wait), XR_ERROR_CALL_ORDER_INVALID, "xrWaitSwapchainImage");
    must(xrAcquireSwapchainImage(swapchain, nullptr, &index), "xrAcquireSwapchainImage");
    checkLogged(probe, xrReleaseSwapchainImage(swapchain, nullptr), XR_ERROR_CALL_ORDER_INVALID,
                "xrReleaseSwapchainImage");
    must(xrWaitSwapchainImage(swapchain, &wait), "xrWaitSwapchainImage");
    checkLogged(probe, xrWaitSwapchainImage(swapchain, &wait), XR_ERROR_CALL_ORDER_INVALID, "xrWaitSwapchainImage");
    must(xrAcquireSwapchainImage(swapchain, nullptr, &index), "xrAcquireSwapchainImage");
    must(xrAcquireSwapchainImage(swapchain, nullptr, &index), "xrAcquireSwapchainImage");
    checkLogged(probe, xrAcquireSwapchainImage(swapchain, nullptr, &index), XR_ERROR_CALL_ORDER_INVALID,
                "xrAcquireSwapchainImage");
}

TEST_CASE("frames that break a rule")
{
    Probe probe("frames_refused", smallViews());
    start(probe);
    probe.runFrame();
    const Probe::Frame frame = probe.waitAndBegin();
    const auto refused = [&](XrResult expected, const Probe::Edit& edit) {
        checkLogged(probe, probe.end(frame, edit), expected, "xrEndFrame");
    };
    const auto view = [](const std::function<void(XrCompositionLayerProjectionView&)>& change) -> Probe::Edit {
        return [change](Views& views, auto&, auto&) { change(views[1]); };
    };
    uint32_t index = 0;
    {
        Probe::Frame not_drawn = frame;
        not_drawn.state.shouldRender = XR_FALSE;
        checkLogged(probe,
                    probe.end(not_drawn,
                              [&](Views& views, auto& layer, auto& info) {
                                  for (const Probe::Swapchain& each : probe.swapchains)
                                      views.push_back({XR_TYPE_COMPOSITION_LAYER_PROJECTION_VIEW,
                                                       nullptr,
                                                       frame.views[0].pose,
                                                       frame.views[0].fov,
                                                       {each.handle, {{0, 0}, {64, 48}}, 0}});
                                  layer.viewCount = 2;
                                  layer.views = views.data();
                                  info.layerCount = 1;
                              }),
                    XR_ERROR_LAYER_INVALID, "xrEndFrame"); // nothing was ever released
    }
    refused(XR_ERROR_LAYER_INVALID, [&](auto&, auto&, auto&) {
        must(xrAcquireSwapchainImage(probe.swapchains[0].handle, nullptr, &index), "xrAcquireSwapchainImage");
    });
    const XrSwapchainImageWaitInfo wait{XR_TYPE_SWAPCHAIN_IMAGE_WAIT_INFO, nullptr, XR_INFINITE_DURATION};
    must(xrWaitSwapchainImage(probe.swapchains[0].handle, &wait), "xrWaitSwapchainImage");
    must(xrReleaseSwapchainImage(probe.swapchains[0].handle, nullptr), "xrReleaseSwapchainImage");

    refused(XR_ERROR_SWAPCHAIN_RECT_INVALID, view([](auto& v) { v.subImage.imageRect.extent.width = 65; }));
    refused(XR_ERROR_SWAPCHAIN_RECT_INVALID, view([](auto& v) { v.subImage.imageRect.offset.y = -1; }));
    refused(XR_ERROR_SWAPCHAIN_RECT_INVALID, view([](auto& v) { v.subImage.imageRect.extent.height = 0; }));
    refused(XR_ERROR_SWAPCHAIN_RECT_INVALID, view([](auto& v) { v.subImage.imageRect.offset.x = INT32_MAX; }));
    refused(XR_ERROR_VALIDATION_FAILURE, view([](auto& v) { v.subImage.imageArrayIndex = 1; }));
    refused(XR_ERROR_HANDLE_INVALID, view([](auto& v) { v.subImage.swapchain = XR_NULL_HANDLE; }));
    refused(XR_ERROR_POSE_INVALID, view([](auto& v) { v.pose.orientation = {0, 0, 0, 0}; }));
    refused(XR_ERROR_POSE_INVALID, view([](auto& v) { v.pose.orientation.w += 0.1f; }));
    refused(XR_ERROR_POSE_INVALID, view([](auto& v) { v.pose.orientation.x = NAN; }));
    refused(XR_ERROR_POSE_INVALID, view([](auto& v) { v.pose.position.x = INFINITY; }));
    refused(XR_ERROR_VALIDATION_FAILURE, view([](auto& v) { std::swap(v.fov.angleLeft, v.fov.angleRight); }));
    refused(XR_ERROR_VALIDATION_FAILURE, view([](auto& v) { v.fov.angleUp = 1.6f; }));
    refused(XR_ERROR_VALIDATION_FAILURE, view([](auto& v) { v.fov.angleDown = NAN; }));
    refused(XR_ERROR_VALIDATION_FAILURE, view([](auto& v) { v.type = XR_TYPE_VIEW; }));
    refused(XR_ERROR_VALIDATION_FAILURE, [](auto&, auto& layer, auto&) { layer.viewCount = 1; });
    refused(XR_ERROR_VALIDATION_FAILURE, [](auto&, auto& layer, auto&) { layer.views = nullptr; });
    refused(XR_ERROR_HANDLE_INVALID, [](auto&, auto& layer, auto&) { layer.space = XR_NULL_HANDLE; });
    refused(XR_ERROR_LAYER_INVALID, [](auto&, auto& layer, auto&) { layer.type = XR_TYPE_VIEW; });
    refused(XR_ERROR_TIME_INVALID, [](auto&, auto&, auto& info) { info.displayTime = 0; });
    refused(XR_ERROR_LAYER_INVALID, [](auto&, auto&, auto& info) { info.layers = nullptr; });
    refused(XR_ERROR_LAYER_INVALID, [](auto&, auto&, auto& info) {
        static const XrCompositionLayerBaseHeader* const kNone[] = {nullptr};
        info.layers = kNone;
    });
    refused(XR_ERROR_LAYER_LIMIT_EXCEEDED, [](auto&, auto&, auto& info) { info.layerCount = 17; });
    refused(XR_ERROR_VALIDATION_FAILURE, [](auto&, auto&, auto& info) { info.type = XR_TYPE_FRAME_STATE; });
    refused(XR_ERROR_ENVIRONMENT_BLEND_MODE_UNSUPPORTED,
            [](auto&, auto&, auto& info) { info.environmentBlendMode = XR_ENVIRONMENT_BLEND_MODE_ADDITIVE; });
    auto depth = xrInfo<XrCompositionLayerDepthInfoKHR>(XR_TYPE_COMPOSITION_LAYER_DEPTH_INFO_KHR);
    refused(XR_ERROR_VALIDATION_FAILURE, view([&](auto& v) { v.next = &depth; }));
    CHECK(probe.end(frame) == XR_SUCCESS); // a refused frame is still begun
    CHECK(probe.logged("views").back()["frame"] == 1);
}

TEST_CASE("swapchains and spaces that cannot be")
{
    Probe probe("swapchains_refused", smallViews({{"stage", false}}));
    probe.openSession();
    probe.openSwapchains();
    const auto refused = [&](XrResult expected, const std::function<void(XrSwapchainCreateInfo&)>& change) {
        XrSwapchainCreateInfo info = probe.swapchains[0].info;
        change(info);
        XrSwapchain swapchain = XR_NULL_HANDLE;
        checkLogged(probe, xrCreateSwapchain(probe.session, &info, &swapchain), expected, "xrCreateSwapchain");
    };
    refused(XR_ERROR_SWAPCHAIN_FORMAT_UNSUPPORTED, [](auto& i) { i.format = VK_FORMAT_R16G16B16A16_SFLOAT; });
    refused(XR_ERROR_FEATURE_UNSUPPORTED, [](auto& i) { i.usageFlags |= XR_SWAPCHAIN_USAGE_UNORDERED_ACCESS_BIT; });
    refused(XR_ERROR_FEATURE_UNSUPPORTED,
            [](auto& i) { i.usageFlags = XR_SWAPCHAIN_USAGE_DEPTH_STENCIL_ATTACHMENT_BIT; });
    refused(XR_ERROR_VALIDATION_FAILURE, [](auto& i) { i.usageFlags = 0; });
    refused(XR_ERROR_VALIDATION_FAILURE, [](auto& i) { i.width = 0; });
    refused(XR_ERROR_VALIDATION_FAILURE, [](auto& i) { i.height = 20000; });
    refused(XR_ERROR_VALIDATION_FAILURE, [](auto& i) { i.mipCount = 0; });
    refused(XR_ERROR_FEATURE_UNSUPPORTED, [](auto& i) { i.sampleCount = 4; });
    refused(XR_ERROR_FEATURE_UNSUPPORTED, [](auto& i) { i.faceCount = 6; });
    refused(XR_ERROR_VALIDATION_FAILURE, [](auto& i) { i.type = XR_TYPE_VIEW; });
    uint32_t index = 0;
    CHECK(xrAcquireSwapchainImage(reinterpret_cast<XrSwapchain>(uint64_t(999)), nullptr, &index) ==
          XR_ERROR_HANDLE_INVALID);

    auto space = xrInfo<XrReferenceSpaceCreateInfo>(XR_TYPE_REFERENCE_SPACE_CREATE_INFO);
    space.referenceSpaceType = XR_REFERENCE_SPACE_TYPE_STAGE;
    space.poseInReferenceSpace.orientation.w = 1;
    XrSpace made = XR_NULL_HANDLE;
    CHECK(xrCreateReferenceSpace(probe.session, &space, &made) == XR_ERROR_REFERENCE_SPACE_UNSUPPORTED);
    space.referenceSpaceType = XR_REFERENCE_SPACE_TYPE_LOCAL;
    space.poseInReferenceSpace.orientation.w = 2;
    CHECK(xrCreateReferenceSpace(probe.session, &space, &made) == XR_ERROR_POSE_INVALID);
    auto location = xrInfo<XrSpaceLocation>(XR_TYPE_SPACE_LOCATION);
    CHECK(xrLocateSpace(probe.local, probe.local, 0, &location) == XR_ERROR_TIME_INVALID);
    CHECK(xrDestroySpace(made) == XR_ERROR_HANDLE_INVALID);
    char text[64];
    uint32_t count = 0;
    CHECK(xrPathToString(probe.instance, 12345, sizeof text, &count, text) == XR_ERROR_PATH_INVALID);
    XrPath path = XR_NULL_PATH;
    CHECK(xrStringToPath(probe.instance, "/User//hand", &path) == XR_ERROR_PATH_FORMAT_INVALID);
    must(xrStringToPath(probe.instance, "/user/hand/left", &path), "xrStringToPath");
    CHECK(xrPathToString(probe.instance, path, sizeof text, &count, text) == XR_SUCCESS);
    CHECK(std::string(text) == "/user/hand/left");
    CHECK(xrPathToString(probe.instance, path, 3, &count, text) == XR_ERROR_SIZE_INSUFFICIENT);
}

TEST_CASE("headsets, extensions and versions that are not there")
{
    XrInstance instance = XR_NULL_HANDLE;
    useSettings(R"({"extensions_withheld": ["XR_KHR_vulkan_enable2"]})");
    CHECK(!offered("XR_KHR_vulkan_enable2"));
    CHECK(offered("XR_MND_headless"));
    CHECK(!offered("XR_EXT_eye_gaze_interaction"));
    CHECK(!offered("XR_VARJO_quad_views"));
    CHECK(createInstance({"XR_KHR_vulkan_enable2"}, &instance, XR_MAKE_VERSION(1, 0, 0)) ==
          XR_ERROR_EXTENSION_NOT_PRESENT);
    CHECK(createInstance({}, &instance, XR_MAKE_VERSION(1, 1, 0)) == XR_ERROR_API_VERSION_UNSUPPORTED);
    useSettings(R"({"sytem": false})");
    CHECK(createInstance({}, &instance, XR_MAKE_VERSION(1, 0, 0)) == XR_ERROR_RUNTIME_FAILURE);
    useSettings("{");
    CHECK(createInstance({}, &instance, XR_MAKE_VERSION(1, 0, 0)) == XR_ERROR_RUNTIME_FAILURE);
    {
        Probe probe("no_headset", {{"system", false}});
        CHECK(probe.system == XR_NULL_SYSTEM_ID);
        checkLogged(probe, XR_ERROR_FORM_FACTOR_UNAVAILABLE, XR_ERROR_FORM_FACTOR_UNAVAILABLE, "xrGetSystem");
        CHECK(createInstance({}, &instance, XR_MAKE_VERSION(1, 0, 0)) == XR_ERROR_LIMIT_REACHED);
        CHECK(!probe.load<PFN_xrVoidFunction>("xrGetVisibilityMaskKHR"));
    }
    Probe probe("headless", {{"gpu", 99}, {"vulkan_min", "1.3"}}, {XR_MND_HEADLESS_EXTENSION_NAME});
    CHECK_THROWS(probe.openVulkan()); // asks for 1.2
    const XrSessionCreateInfo create{XR_TYPE_SESSION_CREATE_INFO, nullptr, 0, probe.system};
    must(xrCreateSession(probe.instance, &create, &probe.session), "xrCreateSession");
    probe.begin();
    CHECK(probe.readStates() ==
          States{XR_SESSION_STATE_SYNCHRONIZED, XR_SESSION_STATE_VISIBLE, XR_SESSION_STATE_FOCUSED});
}

} // namespace gsc::fake_xr
