// SPDX-License-Identifier: Apache-2.0
// Drives the fake runtime as an application does. Needs XR_RUNTIME_JSON = the manifest beside the library.
#include "probe.h"

#include <doctest/doctest.h>

#include <cmath>
#include <cstring>
#include <fstream>

namespace gsc::fake_xr {

namespace {

using nlohmann::json;

constexpr double kDegree = 0.017453292519943295;

void checkNear(const std::vector<double>& found, const std::vector<double>& expected)
{
    REQUIRE(found.size() == expected.size());
    for (size_t i = 0; i < found.size(); ++i) {
        CAPTURE(i);
        CHECK(found[i] == doctest::Approx(expected[i]).epsilon(1e-5).scale(1));
    }
}

std::vector<double> listOf(const XrPosef& pose)
{
    const auto& [q, p] = pose;
    return {p.x, p.y, p.z, q.x, q.y, q.z, q.w};
}

std::vector<double> listOf(const XrFovf& fov)
{
    return {fov.angleLeft, fov.angleRight, fov.angleUp, fov.angleDown};
}

XrSpace makeSpace(const Probe& probe, XrReferenceSpaceType type)
{
    auto info = xrInfo<XrReferenceSpaceCreateInfo>(XR_TYPE_REFERENCE_SPACE_CREATE_INFO);
    info.referenceSpaceType = type;
    info.poseInReferenceSpace.orientation.w = 1;
    XrSpace space = XR_NULL_HANDLE;
    must(xrCreateReferenceSpace(probe.session, &info, &space), "xrCreateReferenceSpace");
    return space;
}

std::string readPpm(const Probe& probe, const char* name, const std::string& head)
{
    std::ifstream file(probe.folder + "/" + name, std::ios::binary);
    const std::string bytes{std::istreambuf_iterator<char>(file), {}};
    REQUIRE(bytes.starts_with(head));
    return bytes.substr(head.size());
}

std::string bytesOf(const XrColor4f& color)
{
    return {char(color.r * 255), char(color.g * 255), char(color.b * 255)};
}

} // namespace

TEST_CASE("twenty frames are logged and dumped as they were submitted")
{
    Probe probe("frames", smallViews({{"dump", true}}));
    start(probe);
    for (int i = 0; i < 20; ++i)
        probe.runFrame();
    CHECK(probe.readStates() ==
          States{XR_SESSION_STATE_SYNCHRONIZED, XR_SESSION_STATE_VISIBLE, XR_SESSION_STATE_FOCUSED});

    const std::vector<json> frames = probe.logged("views");
    REQUIRE(frames.size() == 20);
    for (size_t i = 0; i < frames.size(); ++i) {
        CAPTURE(i);
        CHECK(frames[i]["frame"] == i);
        CHECK(frames[i]["late"] == false);
        CHECK(frames[i]["missed"] == 0);
        CHECK(frames[i]["period"] == 11111111);
        CHECK(frames[i]["display_time"] == 1'000'000'000 + std::llround(double(i) * 1e9 / 90));
        CHECK(frames[i]["views"].size() == (i == 0 ? 0 : 2)); // the first is before VISIBLE
        for (const json& view : frames[i]["views"]) {
            CHECK(view["located"] == i);
            CHECK(view["located_time"] == frames[i]["display_time"]);
            CHECK(view["rect"] == json{0, 0, 64, 48});
            CHECK(view["format"] == 43);
            CHECK(view["depth"].is_null());
            CHECK(view["hash"].get<std::string>().size() == 16);
        }
    }
    CHECK(frames[3]["views"][0]["hash"] != frames[3]["views"][1]["hash"]);
    CHECK(frames[3]["views"][0]["hash"] == frames[5]["views"][0]["hash"]);
    CHECK(frames[3]["views"][0]["hash"] != frames[4]["views"][0]["hash"]);
    for (const uint32_t view : {0u, 1u}) {
        const std::string name = "frame-00007-view-" + std::to_string(view) + ".ppm";
        const std::string pixels = readPpm(probe, name.c_str(), "P6\n64 48\n255\n");
        REQUIRE(pixels.size() == 64 * 48 * 3);
        CHECK(pixels.substr(0, 3) == bytesOf(Probe::colorOf(view, 7)));
        CHECK(pixels.substr(pixels.size() - 3) == bytesOf(Probe::colorOf(view, 7)));
    }
}

TEST_CASE("a picture is the rect of an image whose bytes are in another order")
{
    Probe probe("bgra", smallViews({{"dump", true}, {"formats", {50}}, {"hash", false}}));
    probe.format = VK_FORMAT_B8G8R8A8_SRGB;
    start(probe);
    probe.runFrame();
    probe.end(probe.waitAndBegin(), [](auto& views, auto&, auto&) {
        for (XrCompositionLayerProjectionView& view : views)
            view.subImage.imageRect = {{3, 5}, {20, 10}};
    });
    const json line = probe.logged("views").back();
    CHECK(line["views"][0]["rect"] == json{3, 5, 20, 10});
    CHECK(line["views"][0]["hash"].is_null());
    const std::string pixels = readPpm(probe, "frame-00001-view-1.ppm", "P6\n20 10\n255\n");
    REQUIRE(pixels.size() == 600);
    CHECK(pixels.substr(0, 3) == bytesOf(Probe::colorOf(1, 1)));
}

TEST_CASE("views may be the layers of one image")
{
    Probe probe("array", smallViews({{"dump", true}}));
    probe.array = true;
    start(probe);
    probe.runFrame();
    probe.runFrame();
    CHECK(readPpm(probe, "frame-00001-view-0.ppm", "P6\n64 48\n255\n").substr(0, 3) == bytesOf(Probe::colorOf(0, 1)));
    CHECK(readPpm(probe, "frame-00001-view-1.ppm", "P6\n64 48\n255\n").substr(0, 3) == bytesOf(Probe::colorOf(1, 1)));
}

TEST_CASE("poses and fields of view are those of the script")
{
    const double half = std::sqrt(0.5);
    // the head moves, and turns left by 90 degrees, in one second; the second rotation is on the long way
    const json head{{{"t", 0}, {"position", {0, 0, 0}}, {"rotation", {0, 0, 0, 1}}},
                    {{"t", 1}, {"position", {1, 2, -3}}, {"rotation", {0, -half, 0, -half}}}};
    const double c = std::cos(2.5 * kDegree), s = std::sin(2.5 * kDegree);
    const json views{{{"fov", {-50, 30, 40, -45}}, {"position", {-0.03, 0.01, 0}}, {"rotation", {0, s, 0, c}}},
                     {{"fov", {-30, 50, 41, -46}}, {"position", {0.03, 0.01, 0}}, {"rotation", {0, -s, 0, c}}}};
    Probe probe("poses", {{"head", head}, {"views", views}, {"floor", 1.5}, {"tracking_lost", {{2.0, 2.5}}}});
    probe.openSession();
    probe.begin();
    const XrSpace view_space = makeSpace(probe, XR_REFERENCE_SPACE_TYPE_VIEW);
    const XrSpace stage = makeSpace(probe, XR_REFERENCE_SPACE_TYPE_STAGE);
    for (int i = 0; i < 240; ++i) {
        CAPTURE(i);
        const Probe::Frame frame = probe.waitAndBegin();
        must(probe.end(frame), "xrEndFrame");
        auto location = xrInfo<XrSpaceLocation>(XR_TYPE_SPACE_LOCATION);
        must(xrLocateSpace(view_space, stage, frame.state.predictedDisplayTime, &location), "xrLocateSpace");
        const bool lost = i >= 180 && i < 225;
        CHECK((frame.flags == 0) == lost);
        CHECK((location.locationFlags == 0) == lost);
        CHECK((frame.flags == 15 || lost));
        if (lost)
            continue;
        const double u = std::min(1.0, i / 90.0);
        if (i == 0 || i >= 90) { // nlerp is exact at the keys
            const double turn = i == 0 ? 0 : 90 * kDegree;
            const auto yaw = [](double angle) {
                return std::vector{0.0, std::sin(angle / 2), 0.0, std::cos(angle / 2)};
            };
            for (const int eye : {0, 1}) {
                const double x = eye == 0 ? -0.03 : 0.03;
                std::vector<double> expected{u + x * std::cos(turn), 2 * u + 0.01, -3 * u - x * std::sin(turn)};
                for (const double q : yaw(turn + (eye == 0 ? 5 : -5) * kDegree))
                    expected.push_back(q);
                checkNear(listOf(frame.views[size_t(eye)].pose), expected);
            }
            std::vector<double> in_stage{u, 2 * u + 1.5, -3 * u};
            for (const double q : yaw(turn))
                in_stage.push_back(q);
            checkNear(listOf(location.pose), in_stage);
        }
        CHECK(location.pose.position.x == doctest::Approx(u).epsilon(1e-5));
        checkNear(listOf(frame.views[0].fov), {-50 * kDegree, 30 * kDegree, 40 * kDegree, -45 * kDegree});
        checkNear(listOf(frame.views[1].fov), {-30 * kDegree, 50 * kDegree, 41 * kDegree, -46 * kDegree});
    }
}

TEST_CASE("a submitted pose names the frame that it was located in, or none")
{
    Probe probe("located", smallViews());
    start(probe);
    probe.runFrame();
    const Probe::Frame old = probe.waitAndBegin();
    must(probe.end(old), "xrEndFrame");
    for (int i = 0; i < 3; ++i) {
        Probe::Frame frame = probe.waitAndBegin();
        frame.views = old.views; // a slow renderer
        must(probe.end(frame), "xrEndFrame");
    }
    Probe::Frame turned = probe.waitAndBegin();
    std::swap(turned.views[0], turned.views[1]);
    must(probe.end(turned), "xrEndFrame");
    Probe::Frame foreign = probe.waitAndBegin();
    const XrSpace stage = makeSpace(probe, XR_REFERENCE_SPACE_TYPE_STAGE);
    must(probe.end(foreign,
                   [&](auto&, auto& layer, auto& info) {
                       layer.space = stage;
                       ++info.displayTime;
                   }),
         "xrEndFrame");
    const std::vector<json> lines = probe.logged("views");
    CHECK(lines[4]["views"][0]["located"] == 1);
    CHECK(lines[4]["views"][1]["located_time"] == lines[1]["display_time"]);
    CHECK(lines[5]["views"][0]["located"].is_null());
    CHECK(lines[6]["views"][1]["located"].is_null());
    CHECK(lines[6]["views"][1]["space"] == "STAGE");
    CHECK(lines[5]["late"] == false);
    CHECK(lines[6]["late"] == true);
}

TEST_CASE("quad views and mono are loops over other counts")
{
    const json view{{"width", 32}, {"height", 16}};
    {
        Probe probe("quad", {{"configuration", "quad"}, {"views", {view, view, view, view}}, {"dump", true}},
                    {XR_VARJO_QUAD_VIEWS_EXTENSION_NAME});
        CHECK(probe.configuration == XR_VIEW_CONFIGURATION_TYPE_PRIMARY_QUAD_VARJO);
        start(probe);
        CHECK(probe.sizes.size() == 4);
        CHECK(probe.sizes[2].maxImageRectWidth == 64);
        for (int i = 0; i < 3; ++i)
            probe.runFrame();
        const json line = probe.logged("views").back();
        CHECK(line["views"].size() == 4);
        CHECK(line["views"][3]["located"] == 2);
        CHECK(line["views"][3]["fov"] != line["views"][1]["fov"]);
        readPpm(probe, "frame-00002-view-3.ppm", "P6\n32 16\n255\n");
    }
    {
        Probe probe("quad_not_taken", {{"configuration", "quad"}});
        CHECK(probe.configuration == XR_VIEW_CONFIGURATION_TYPE_PRIMARY_STEREO);
    }
    Probe probe("mono", {{"configuration", "mono"}, {"views", {view}}});
    CHECK(probe.configuration == XR_VIEW_CONFIGURATION_TYPE_PRIMARY_MONO);
    start(probe);
    probe.runFrame();
    probe.runFrame();
    CHECK(probe.logged("views").back()["views"].size() == 1);
}

TEST_CASE("a depth layer is logged")
{
    Probe probe("depth", smallViews({{"dump", true}}), {XR_KHR_COMPOSITION_LAYER_DEPTH_EXTENSION_NAME});
    start(probe);
    XrSwapchainCreateInfo info = probe.swapchains[0].info;
    info.format = VK_FORMAT_D32_SFLOAT;
    info.usageFlags = XR_SWAPCHAIN_USAGE_DEPTH_STENCIL_ATTACHMENT_BIT | XR_SWAPCHAIN_USAGE_TRANSFER_DST_BIT;
    XrSwapchain swapchain = XR_NULL_HANDLE;
    must(xrCreateSwapchain(probe.session, &info, &swapchain), "xrCreateSwapchain");
    probe.runFrame();
    uint32_t index = 0;
    must(xrAcquireSwapchainImage(swapchain, nullptr, &index), "xrAcquireSwapchainImage");
    const XrSwapchainImageWaitInfo wait{XR_TYPE_SWAPCHAIN_IMAGE_WAIT_INFO, nullptr, XR_INFINITE_DURATION};
    must(xrWaitSwapchainImage(swapchain, &wait), "xrWaitSwapchainImage");
    must(xrReleaseSwapchainImage(swapchain, nullptr), "xrReleaseSwapchainImage");
    auto depth = xrInfo<XrCompositionLayerDepthInfoKHR>(XR_TYPE_COMPOSITION_LAYER_DEPTH_INFO_KHR);
    depth.subImage = {swapchain, {{0, 0}, {64, 48}}, 0};
    depth.maxDepth = 1;
    depth.nearZ = 0.25f;
    depth.farZ = 100;
    const auto submit = [&] {
        return probe.end(probe.waitAndBegin(), [&](auto& views, auto&, auto&) { views[0].next = &depth; });
    };
    CHECK(submit() == XR_SUCCESS);
    const json line = probe.logged("views").back();
    CHECK(line["views"][0]["depth"] == json{{"near", 0.25}, {"far", 100.0}});
    CHECK(line["views"][1]["depth"].is_null());
    CHECK(std::ifstream(probe.folder + "/frame-00001-view-0.depth", std::ios::ate | std::ios::binary).tellg() ==
          64 * 48 * 4);
    depth.farZ = INFINITY;
    CHECK(submit() == XR_SUCCESS);
    CHECK(probe.logged("views").back()["views"][0]["depth"]["far"] == "inf");
    depth.minDepth = 2;
    CHECK(submit() == XR_ERROR_VALIDATION_FAILURE);
    depth.minDepth = 0;
    depth.subImage.swapchain = probe.swapchains[0].handle;
    CHECK(probe.end(probe.waitAndBegin(), [&](auto& views, auto&, auto&) { views[0].next = &depth; }) ==
          XR_ERROR_VALIDATION_FAILURE);
    depth.subImage = {swapchain, {{0, 0}, {32, 48}}, 0};
    CHECK(submit() == XR_ERROR_SWAPCHAIN_RECT_INVALID);
    must(xrDestroySwapchain(swapchain), "xrDestroySwapchain");
}

} // namespace gsc::fake_xr
