// SPDX-License-Identifier: Apache-2.0
// Events that the fake runtime causes over time: states, losses, the clock.
#include "probe.h"

#include <doctest/doctest.h>

#include <chrono>
#include <thread>

namespace gsc::fake_xr {

namespace {

using nlohmann::json;

json event(int frame, const char* what)
{
    return {{"frame", frame}, {"do", what}};
}

// The frames that asked to be drawn, among the first ones.
std::vector<bool> renderedFrames(Probe& probe, int count)
{
    std::vector<bool> rendered;
    for (int i = 0; i < count; ++i) {
        const Probe::Frame frame = probe.waitAndBegin();
        rendered.push_back(frame.state.shouldRender);
        must(probe.end(frame), "xrEndFrame");
    }
    return rendered;
}

constexpr auto kSynchronized = XR_SESSION_STATE_SYNCHRONIZED, kVisible = XR_SESSION_STATE_VISIBLE,
               kFocused = XR_SESSION_STATE_FOCUSED, kStopping = XR_SESSION_STATE_STOPPING,
               kIdle = XR_SESSION_STATE_IDLE, kReady = XR_SESSION_STATE_READY, kExiting = XR_SESSION_STATE_EXITING;

double millisecondsOf(const std::function<void()>& work)
{
    const auto before = std::chrono::steady_clock::now();
    work();
    return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - before).count();
}

} // namespace

TEST_CASE("a headset taken off and put on again, a dashboard, and the end")
{
    Probe probe(
        "states",
        smallViews({{"events",
                     {event(2, "hide"), event(4, "show"), event(6, "unfocus"), event(7, "focus"), event(8, "exit")}}}));
    probe.openSession();
    probe.openSwapchains();
    CHECK(probe.readStates() == States{kIdle, kReady});
    const XrSessionBeginInfo info{XR_TYPE_SESSION_BEGIN_INFO, nullptr, probe.configuration};
    must(xrBeginSession(probe.session, &info), "xrBeginSession");
    CHECK(renderedFrames(probe, 2) == std::vector<bool>{false, true});
    CHECK(probe.readStates() == States{kSynchronized, kVisible, kFocused});
    CHECK(renderedFrames(probe, 2) == std::vector<bool>{false, false});
    CHECK(probe.readStates() == States{kVisible, kSynchronized});
    CHECK(renderedFrames(probe, 4) == std::vector<bool>(4, true));
    CHECK(probe.readStates() == States{kVisible, kFocused, kVisible, kFocused});
    CHECK(xrEndSession(probe.session) == XR_ERROR_SESSION_NOT_STOPPING);
    CHECK(renderedFrames(probe, 1) == std::vector<bool>{false});
    CHECK(probe.readStates() == States{kVisible, kSynchronized, kStopping});
    CHECK(xrEndSession(probe.session) == XR_SUCCESS);
    CHECK(probe.readStates() == States{kIdle, kExiting});
    auto state = xrInfo<XrFrameState>(XR_TYPE_FRAME_STATE);
    CHECK(xrWaitFrame(probe.session, nullptr, &state) == XR_ERROR_SESSION_NOT_RUNNING);
    const json hidden{{"event", "SYNCHRONIZED"}, {"frame", 2}};
    const std::vector<json> events = probe.logged("event");
    CHECK(std::count(events.begin(), events.end(), hidden) == 1);
}

TEST_CASE("an application ends its own session")
{
    Probe probe("request_exit", smallViews());
    CHECK(xrRequestExitSession(XR_NULL_HANDLE) == XR_ERROR_HANDLE_INVALID);
    probe.openSession();
    CHECK(xrRequestExitSession(probe.session) == XR_ERROR_SESSION_NOT_RUNNING);
    probe.begin();
    probe.runFrame();
    probe.readStates();
    CHECK(xrRequestExitSession(probe.session) == XR_SUCCESS);
    CHECK(probe.readStates() == States{kVisible, kSynchronized, kStopping});
    CHECK(xrEndSession(probe.session) == XR_SUCCESS);
    CHECK(probe.readStates() == States{kIdle, kExiting});
}

TEST_CASE("a session that was stopped is ready again after some polls")
{
    Probe probe("restart", smallViews({{"events", {event(3, "stop"), event(3, "restart"), event(6, "exit")}}}));
    start(probe);
    renderedFrames(probe, 5); // the application is slow to notice
    const States states = probe.readStates();
    CHECK(states.back() == kStopping);
    CHECK(xrEndSession(probe.session) == XR_SUCCESS);
    CHECK(probe.readStates() == States{kIdle}); // with the first of 20 polls
    for (int poll = 2; poll < 20; ++poll)
        CHECK(probe.readStates().empty());
    probe.begin();
    CHECK(renderedFrames(probe, 1) == std::vector<bool>{false});
    CHECK(probe.readStates() == States{kSynchronized, kVisible, kFocused});
    renderedFrames(probe, 1);
    CHECK(probe.readStates().back() == kStopping);
}

TEST_CASE("losses")
{
    auto state = xrInfo<XrFrameState>(XR_TYPE_FRAME_STATE);
    SUBCASE("pending")
    {
        Probe probe("loss_pending", smallViews({{"events", {event(2, "loss_pending")}}}));
        start(probe);
        renderedFrames(probe, 2);
        probe.readStates();
        CHECK(xrWaitFrame(probe.session, nullptr, &state) == XR_SUCCESS);
        CHECK(probe.readStates() == States{XR_SESSION_STATE_LOSS_PENDING});
        CHECK(xrBeginFrame(probe.session, nullptr) == XR_ERROR_SESSION_LOST);
        uint32_t index = 0;
        CHECK(xrAcquireSwapchainImage(probe.swapchains[0].handle, nullptr, &index) == XR_ERROR_SESSION_LOST);
        probe.closeSession();
        start(probe); // there can be another one
        CHECK(renderedFrames(probe, 2) == std::vector<bool>{false, true});
    }
    SUBCASE("at once")
    {
        Probe probe("session_lost", smallViews({{"events", {event(1, "session_lost")}}}));
        start(probe);
        renderedFrames(probe, 1);
        CHECK(xrWaitFrame(probe.session, nullptr, &state) == XR_ERROR_SESSION_LOST);
        CHECK(xrEndSession(probe.session) == XR_ERROR_SESSION_LOST);
        CHECK(probe.logged("error")[0]["function"] == "xrWaitFrame");
    }
    SUBCASE("of the instance")
    {
        {
            Probe probe("instance_lost", smallViews({{"events", {event(1, "instance_lost")}}}));
            start(probe);
            renderedFrames(probe, 1);
            probe.readStates();
            CHECK(xrWaitFrame(probe.session, nullptr, &state) == XR_ERROR_INSTANCE_LOST);
            auto buffer = xrInfo<XrEventDataBuffer>(XR_TYPE_EVENT_DATA_BUFFER);
            CHECK(xrPollEvent(probe.instance, &buffer) == XR_SUCCESS);
            CHECK(buffer.type == XR_TYPE_EVENT_DATA_INSTANCE_LOSS_PENDING);
            buffer = xrInfo<XrEventDataBuffer>(XR_TYPE_EVENT_DATA_BUFFER);
            CHECK(xrPollEvent(probe.instance, &buffer) == XR_ERROR_INSTANCE_LOST);
            XrSystemId system = 0;
            const XrSystemGetInfo get{XR_TYPE_SYSTEM_GET_INFO, nullptr, XR_FORM_FACTOR_HEAD_MOUNTED_DISPLAY};
            CHECK(xrGetSystem(probe.instance, &get, &system) == XR_ERROR_INSTANCE_LOST);
        }
        Probe probe("instance_after_loss", smallViews());
        start(probe);
        CHECK(renderedFrames(probe, 2) == std::vector<bool>{false, true});
    }
}

TEST_CASE("the virtual clock steps by the period, which may change")
{
    Probe probe("rates", smallViews({{"hz", 50}, {"period_changes", {{{"frame", 3}, {"hz", 100}}}}}),
                {XR_FB_DISPLAY_REFRESH_RATE_EXTENSION_NAME, XR_KHR_CONVERT_TIMESPEC_TIME_EXTENSION_NAME});
    start(probe);
    std::vector<int64_t> times, periods;
    for (int i = 0; i < 6; ++i) {
        const Probe::Frame frame = probe.waitAndBegin();
        times.push_back(frame.state.predictedDisplayTime - 1'000'000'000);
        periods.push_back(frame.state.predictedDisplayPeriod);
        probe.end(frame);
    }
    CHECK(times == std::vector<int64_t>{0, 20'000'000, 40'000'000, 60'000'000, 70'000'000, 80'000'000});
    CHECK(periods == std::vector<int64_t>{20'000'000, 20'000'000, 20'000'000, 10'000'000, 10'000'000, 10'000'000});
    probe.readStates();
    CHECK(probe.other_events == std::vector{XR_TYPE_EVENT_DATA_DISPLAY_REFRESH_RATE_CHANGED_FB});
    float rate = 0;
    const auto get = probe.load<PFN_xrGetDisplayRefreshRateFB>("xrGetDisplayRefreshRateFB");
    CHECK(get(probe.session, &rate) == XR_SUCCESS);
    CHECK(rate == 100);
    const auto request = probe.load<PFN_xrRequestDisplayRefreshRateFB>("xrRequestDisplayRefreshRateFB");
    CHECK(request(probe.session, 50) == XR_SUCCESS);
    CHECK(request(probe.session, 51) == XR_ERROR_DISPLAY_REFRESH_RATE_UNSUPPORTED_FB);
    CHECK(probe.waitAndBegin().state.predictedDisplayPeriod == 20'000'000);
    const auto convert = probe.load<PFN_xrConvertTimespecTimeToTimeKHR>("xrConvertTimespecTimeToTimeKHR");
    const timespec any{5, 5};
    XrTime now = 0;
    CHECK(convert(probe.instance, &any, &now) == XR_SUCCESS);
    CHECK(now == 1'000'000'000 + 80'000'000);
}

TEST_CASE("the real clock sleeps to the refresh and counts what was missed")
{
    Probe probe("real", smallViews({{"clock", "real"}, {"hz", 50}, {"hash", false}}));
    start(probe);
    renderedFrames(probe, 2);
    const double ms = millisecondsOf([&] { renderedFrames(probe, 10); });
    CHECK(ms > 180);
    CHECK(ms < 400); // 200 on a machine with nothing else to do
    Probe::Frame frame = probe.waitAndBegin();
    std::this_thread::sleep_for(std::chrono::milliseconds(70)); // three refreshes go by
    probe.end(frame);
    CHECK(probe.logged("views").back()["missed"] >= 3);
    const XrTime before = frame.state.predictedDisplayTime;
    frame = probe.waitAndBegin();
    CHECK(frame.state.predictedDisplayTime >= before + 70'000'000);
    CHECK((frame.state.predictedDisplayTime - before) % 20'000'000 == 0);
    probe.end(frame);
}

TEST_CASE("one thread waits while another one draws")
{
    Probe probe("threads", smallViews({{"blocked_ms", 200}}));
    start(probe);
    probe.runFrame();
    const Probe::Frame drawn = probe.waitAndBegin();
    std::thread waiter([&] {
        auto state = xrInfo<XrFrameState>(XR_TYPE_FRAME_STATE);
        CHECK(xrWaitFrame(probe.session, nullptr, &state) == XR_SUCCESS);
        CHECK(state.predictedDisplayTime > drawn.state.predictedDisplayTime);
    });
    waiter.join();
    CHECK(probe.end(drawn) == XR_SUCCESS);
    CHECK(probe.logged("views").back()["late"] == false);
    CHECK(probe.logged("error").empty());
    // the next one blocks until this one is begun, and not for ever
    auto state = xrInfo<XrFrameState>(XR_TYPE_FRAME_STATE);
    CHECK(millisecondsOf([&] { CHECK(xrWaitFrame(probe.session, nullptr, &state) == XR_ERROR_CALL_ORDER_INVALID); }) >
          190);
    std::thread late([&] { CHECK(xrWaitFrame(probe.session, nullptr, &state) == XR_SUCCESS); });
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    CHECK(xrBeginFrame(probe.session, nullptr) == XR_SUCCESS);
    late.join();
    CHECK(xrBeginFrame(probe.session, nullptr) == XR_FRAME_DISCARDED);
    std::thread drawer([&] { probe.draw(0, 0); });
    drawer.join();
    const json line = probe.logged("error").back();
    CHECK(line["why"] == "frame and swapchain calls come from two threads");
}

} // namespace gsc::fake_xr
