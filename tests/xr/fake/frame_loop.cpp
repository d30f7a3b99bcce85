// SPDX-License-Identifier: Apache-2.0
#include "functions.h"
#include "session.h"
#include "submission.h"

#include <chrono>

namespace gsc::fake_xr {

namespace {

using Lock = std::unique_lock<std::mutex>;

// A real runtime blocks until the frame before was begun, by whatever thread. Blocking for ever would hang a test.
void waitForTurn(Runtime& rt, Lock& lock, XrSession handle)
{
    const auto free = [&] {
        const Session* s = rt.session.get();
        return s == nullptr || idOf(handle) != s->id || !s->running || (!s->waiting && !s->waited);
    };
    if (!rt.changed.wait_for(lock, std::chrono::milliseconds(rt.settings.blocked_ms), free))
        refuse(XR_ERROR_CALL_ORDER_INVALID, "the frame before was never begun; a real runtime blocks for ever");
}

// The next frame, and when to hand it out: real, one refresh before it shows; virtual, at once.
Frame nextFrame(Runtime& rt, const Session& session, int64_t number, XrTime& wake)
{
    const bool real = rt.settings.real_clock;
    if (real && !rt.started)
        rt.refreshes.start(rt.refreshes.rate(), monotonicNow());
    for (; rt.next_rate < rt.settings.rate_changes.size() && rt.settings.rate_changes[rt.next_rate].frame <= number;
         ++rt.next_rate)
        rt.setRate(rt.settings.rate_changes[rt.next_rate].hz);
    int64_t shown = number;
    wake = 0;
    if (real) {
        // a refresh that has begun is lost, as for an application that asks too late
        const int64_t earliest = rt.refreshes.indexAfter(monotonicNow());
        const int64_t at = rt.started ? std::max(earliest, rt.refresh + 1) : earliest;
        wake = rt.refreshes.timeOf(at);
        rt.refresh = at;
        shown = at + 1;
    }
    rt.predicted = rt.refreshes.timeOf(shown);
    if (!rt.started)
        rt.script_start = rt.predicted;
    rt.started = true;
    const bool seen = session.state == XR_SESSION_STATE_VISIBLE || session.state == XR_SESSION_STATE_FOCUSED;
    return {number, rt.predicted, rt.refreshes.period(), seen && session.gpu};
}

// Refreshes that went by without a new frame since the last one.
int64_t missedRefreshes(Runtime& rt, Session& session)
{
    if (!rt.settings.real_clock)
        return 0;
    const int64_t shown = rt.refreshes.indexAfter(monotonicNow());
    const int64_t missed = session.last_refresh ? std::max<int64_t>(0, shown - *session.last_refresh - 1) : 0;
    session.last_refresh = shown;
    return missed;
}

} // namespace

XrResult xrWaitFrame(XrSession handle, const XrFrameWaitInfo* info, XrFrameState* out)
{
    return guarded("xrWaitFrame", [&](Runtime& rt, Lock& lock) {
        rt.requireRunning(handle);
        allowType(info, XR_TYPE_FRAME_WAIT_INFO, "frameWaitInfo");
        requireType(out, XR_TYPE_FRAME_STATE, "frameState");
        waitForTurn(rt, lock, handle);
        Session& session = rt.requireRunning(handle);
        const int64_t number = rt.frames++;
        playEvents(rt, number);
        XrTime wake = 0;
        const Frame frame = nextFrame(rt, session, number, wake);
        session.waiting = true;
        if (wake != 0) {
            lock.unlock();
            sleepUntil(wake);
            lock.lock();
        }
        // the session may have ended meanwhile; a loss that this frame's events brought shows in the next call
        if (!rt.session || idOf(handle) != rt.session->id)
            refuse(XR_ERROR_HANDLE_INVALID, "the session was destroyed meanwhile");
        rt.session->waiting = false;
        rt.changed.notify_all();
        if (!rt.session->running)
            refuse(XR_ERROR_SESSION_NOT_RUNNING, "the session ended meanwhile");
        rt.session->waited = frame;
        out->predictedDisplayTime = frame.predicted;
        out->predictedDisplayPeriod = frame.period;
        out->shouldRender = frame.should_render ? XR_TRUE : XR_FALSE;
        return XR_SUCCESS;
    });
}

XrResult xrBeginFrame(XrSession handle, const XrFrameBeginInfo* info)
{
    return guarded("xrBeginFrame", [&](Runtime& rt) {
        Session& session = rt.requireRunning(handle);
        watchThread(rt, session, "xrBeginFrame");
        allowType(info, XR_TYPE_FRAME_BEGIN_INFO, "frameBeginInfo");
        if (!session.waited)
            refuse(XR_ERROR_CALL_ORDER_INVALID, "no xrWaitFrame came before");
        const bool discarded = session.begun.has_value();
        if (discarded)
            rt.log.line(formatString(R"({"event":"frame_discarded","frame":%lld})",
                                     static_cast<long long>(session.begun->number)));
        session.begun = session.waited;
        session.waited.reset();
        rt.changed.notify_all();
        return discarded ? XR_FRAME_DISCARDED : XR_SUCCESS;
    });
}

XrResult xrEndFrame(XrSession handle, const XrFrameEndInfo* info)
{
    return guarded("xrEndFrame", [&](Runtime& rt) {
        Session& session = rt.requireRunning(handle);
        watchThread(rt, session, "xrEndFrame");
        requireType(info, XR_TYPE_FRAME_END_INFO, "frameEndInfo");
        if (!session.begun)
            refuse(XR_ERROR_CALL_ORDER_INVALID, "no xrBeginFrame came before");
        checkFrame(rt, session, *info);
        recordFrame(rt, session, *info, missedRefreshes(rt, session));
        session.begun.reset();
        if (session.state == XR_SESSION_STATE_READY) // the first frame since xrBeginSession
            becomeFocused(rt);
        return XR_SUCCESS;
    });
}

} // namespace gsc::fake_xr
