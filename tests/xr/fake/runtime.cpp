// SPDX-License-Identifier: Apache-2.0
#include "runtime.h"

#include "session.h"

#include <filesystem>

namespace gsc::fake_xr {

namespace {

constexpr XrTime kVirtualStart = 1'000'000'000; // 0 is no time in OpenXR

const char* nameOf(XrSessionState state)
{
    switch (state) {
    case XR_SESSION_STATE_IDLE:
        return "IDLE";
    case XR_SESSION_STATE_READY:
        return "READY";
    case XR_SESSION_STATE_SYNCHRONIZED:
        return "SYNCHRONIZED";
    case XR_SESSION_STATE_VISIBLE:
        return "VISIBLE";
    case XR_SESSION_STATE_FOCUSED:
        return "FOCUSED";
    case XR_SESSION_STATE_STOPPING:
        return "STOPPING";
    case XR_SESSION_STATE_LOSS_PENDING:
        return "LOSS_PENDING";
    case XR_SESSION_STATE_EXITING:
        return "EXITING";
    default:
        return "UNKNOWN";
    }
}

} // namespace

// Never destroyed: at the end of the process the Vulkan objects it might still hold are gone.
Runtime& runtime()
{
    static Runtime& rt = *new Runtime;
    return rt;
}

void refuse(XrResult code, std::string why)
{
    throw Refused{code, std::move(why)};
}

XrResult report(Runtime& rt, const char* function, XrResult code, const std::string& why)
{
    if (rt.log.isOpen())
        rt.log.line(formatString(R"({"error":%d,"function":"%s","why":%s})", code, function, quoted(why).c_str()));
    else
        std::fprintf(stderr, "gsc_fake_xr: %s: error %d: %s\n", function, code, why.c_str());
    return code;
}

void Runtime::readSettings()
{
    if (instance != 0)
        return;
    settings = fake_xr::readSettings();
    log.open(settings.log);
    if (!settings.dump.empty())
        std::filesystem::create_directories(settings.dump);
}

void Runtime::createInstance(const std::set<std::string>& wanted)
{
    instance = next_id++;
    instance_lost = started = false;
    extensions = wanted;
    events.clear();
    paths.clear();
    vulkan = {};
    actions = {};
    frames = refresh = 0;
    next_event = next_rate = 0;
    // the real clock starts again at its first frame
    const XrTime start = settings.real_clock ? monotonicNow() : kVirtualStart;
    refreshes.start(settings.hz, start);
    script_start = predicted = start;
    log.line(R"({"event":"instance_created"})");
}

void Runtime::destroyInstance()
{
    destroySession(*this);
    instance = 0;
    instance_lost = false;
    log.line(R"({"event":"instance_destroyed"})");
}

void Runtime::requireInstance(XrInstance handle) const
{
    if (instance == 0 || idOf(handle) != instance)
        refuse(XR_ERROR_HANDLE_INVALID, "no such instance");
}

void Runtime::requireSystem(XrInstance handle, XrSystemId system) const
{
    requireInstance(handle);
    if (system != kSystem || !settings.system)
        refuse(XR_ERROR_SYSTEM_INVALID, formatString("no system %llu", static_cast<unsigned long long>(system)));
}

Session& Runtime::requireSession()
{
    if (!session)
        refuse(XR_ERROR_HANDLE_INVALID, "no session");
    if (session->lost)
        refuse(XR_ERROR_SESSION_LOST, "the session is lost");
    return *session;
}

Session& Runtime::requireSession(XrSession handle)
{
    if (!session || idOf(handle) != session->id)
        refuse(XR_ERROR_HANDLE_INVALID, "no such session");
    return requireSession();
}

Session& Runtime::requireRunning(XrSession handle)
{
    Session& s = requireSession(handle);
    if (!s.running)
        refuse(XR_ERROR_SESSION_NOT_RUNNING, "the session does not run");
    return s;
}

Space& Runtime::requireSpace(XrSpace handle)
{
    Session& s = requireSession();
    const auto found = s.spaces.find(idOf(handle));
    if (found == s.spaces.end())
        refuse(XR_ERROR_HANDLE_INVALID, "no such space");
    return found->second;
}

Swapchain& Runtime::requireSwapchain(XrSwapchain handle)
{
    Session& s = requireSession();
    const auto found = s.swapchains.find(idOf(handle));
    if (found == s.swapchains.end())
        refuse(XR_ERROR_HANDLE_INVALID, "no such swapchain");
    return found->second;
}

std::string Runtime::requirePath(XrPath path) const
{
    if (path == XR_NULL_PATH || path > paths.size())
        refuse(XR_ERROR_PATH_INVALID, formatString("no path %llu", static_cast<unsigned long long>(path)));
    return paths[path - 1];
}

XrPath Runtime::pathOf(const std::string& text)
{
    const auto found = std::find(paths.begin(), paths.end(), text);
    const auto index = XrPath(found - paths.begin());
    if (found == paths.end())
        paths.push_back(text);
    return index + 1;
}

// The virtual clock stands still between two calls of xrWaitFrame, one period before the newest frame shows.
XrTime Runtime::now() const
{
    if (settings.real_clock)
        return monotonicNow();
    return (started ? predicted : refreshes.timeOf(0)) - refreshes.period();
}

void Runtime::setState(XrSessionState state)
{
    session->state = state;
    send(XrEventDataSessionStateChanged{XR_TYPE_EVENT_DATA_SESSION_STATE_CHANGED, nullptr,
                                        handleOf<XrSession>(session->id), state, now()});
    log.line(formatString(R"({"event":"%s","frame":%lld})", nameOf(state), static_cast<long long>(frames - 1)));
}

void Runtime::setRate(double hz)
{
    if (hz == refreshes.rate())
        return;
    if (enabled(XR_FB_DISPLAY_REFRESH_RATE_EXTENSION_NAME))
        send(XrEventDataDisplayRefreshRateChangedFB{XR_TYPE_EVENT_DATA_DISPLAY_REFRESH_RATE_CHANGED_FB, nullptr,
                                                    float(refreshes.rate()), float(hz)});
    refreshes.setRate(hz, settings.real_clock ? refresh : std::max<int64_t>(0, frames - 1));
    log.line(formatString(R"({"event":"refresh_rate_changed","frame":%lld,"hz":%g})",
                          static_cast<long long>(frames - 1), hz));
}

} // namespace gsc::fake_xr
