// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "actions.h"
#include "clock.h"
#include "gpu.h"
#include "log.h"
#include "script.h"

#include <algorithm>
#include <condition_variable>
#include <cstring>
#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <thread>

namespace gsc::fake_xr {

constexpr XrSystemId kSystem = 1;

template <typename Handle>
uint64_t idOf(Handle handle)
{
    return reinterpret_cast<uint64_t>(handle);
}

template <typename Handle>
Handle handleOf(uint64_t id)
{
    return reinterpret_cast<Handle>(id);
}

struct Frame {
    int64_t number; // number in the instance, 0 is its first xrWaitFrame
    XrTime predicted;
    XrDuration period;
    bool should_render;
};

struct Space {
    std::optional<XrReferenceSpaceType> reference; // none: an action's
    uint64_t action = 0;
    std::string user_path; // path of an action's space, empty = any
    XrPosef offset = kIdentity;
};

struct Swapchain {
    XrSwapchainCreateInfo info;
    std::vector<GpuImage> images;
    std::deque<uint32_t> acquired; // oldest first
    bool waited = false;           // for the oldest
    uint32_t next = 0;
    std::optional<uint32_t> released; // the latest
};

// A view as xrLocateViews handed it out.
struct LocatedView {
    XrPosef pose;
    XrFovf fov;
    uint64_t space;
    int64_t frame;
    XrTime time;
};

struct Session {
    uint64_t id = 0;
    std::unique_ptr<Gpu> gpu; // none: headless
    XrSessionState state = XR_SESSION_STATE_UNKNOWN;
    XrViewConfigurationType configuration = XR_VIEW_CONFIGURATION_TYPE_PRIMARY_STEREO;
    bool running = false, exiting = false, lost = false;
    std::optional<uint32_t> polls_to_restart;

    bool waiting = false; // some thread is in xrWaitFrame
    std::optional<Frame> waited, begun;
    std::optional<int64_t> last_refresh; // real clock: the one that the last xrEndFrame was in time for

    std::map<uint64_t, Space> spaces;
    std::map<uint64_t, Swapchain> swapchains;
    std::vector<std::deque<LocatedView>> located; // by view, latest last

    std::thread::id frame_thread; // thread of the first frame or swapchain call
    std::set<std::string> other_thread_reported;
};

// Vulkan objects that the application created with the runtime's help: xrCreateSession takes no others.
struct VulkanObjects {
    bool requirements_asked = false;
    PFN_vkGetInstanceProcAddr loader = nullptr;
    VkInstance instance = VK_NULL_HANDLE;
    VkPhysicalDevice physical = VK_NULL_HANDLE;
    VkDevice device = VK_NULL_HANDLE;
    std::map<uint32_t, uint32_t> queues; // count by family
};

// All state, behind one mutex. The loader keeps one instance at a time, and so does this.
struct Runtime {
    std::mutex mutex;
    std::condition_variable changed; // a frame was begun, a session ended
    Settings settings;
    Log log;

    uint64_t instance = 0; // 0 = none
    bool instance_lost = false;
    uint64_t next_id = 1; // one series for all kinds of handles, never used again: a stale handle is always found out
    std::set<std::string> extensions;
    std::deque<XrEventDataBuffer> events;
    std::vector<std::string> paths; // XrPath is the index + 1
    VulkanObjects vulkan;
    Actions actions;
    std::unique_ptr<Session> session;

    RefreshGrid refreshes;
    bool started = false;    // a first xrWaitFrame there was
    XrTime script_start = 0; // the predicted display time of frame 0
    XrTime predicted = 0;    // display time of the newest frame
    int64_t refresh = 0;     // the newest frame's, real clock
    int64_t frames = 0;      // calls of xrWaitFrame
    size_t next_event = 0, next_rate = 0;

    void readSettings(); // unless there is an instance
    void createInstance(const std::set<std::string>& wanted);
    void destroyInstance();

    // They refuse what is no such handle, or is lost.
    void requireInstance(XrInstance handle) const;
    void requireSystem(XrInstance handle, XrSystemId system) const;
    Session& requireSession(XrSession handle);
    Session& requireSession(); // session of a space or swapchain
    Session& requireRunning(XrSession handle);
    Space& requireSpace(XrSpace handle);
    Swapchain& requireSwapchain(XrSwapchain handle);
    std::string requirePath(XrPath path) const;

    [[nodiscard]] bool enabled(const char* extension) const { return extensions.contains(extension); }
    [[nodiscard]] double scriptTime(XrTime time) const { return double(time - script_start) * 1e-9; }
    [[nodiscard]] XrTime now() const;
    XrPath pathOf(const std::string& text);

    void setState(XrSessionState state);
    void setRate(double hz); // from the newest refresh on
    template <typename Event>
    void send(const Event& event);
};

Runtime& runtime();

// The application broke a rule. guarded() logs it and returns the code.
struct Refused {
    XrResult code;
    std::string why;
};

[[noreturn]] void refuse(XrResult code, std::string why);
XrResult report(Runtime& rt, const char* function, XrResult code, const std::string& why);

template <typename Struct>
void requireType(const Struct* object, XrStructureType type, const char* name)
{
    if (object == nullptr)
        refuse(XR_ERROR_VALIDATION_FAILURE, std::string(name) + " is null");
    if (object->type != type)
        refuse(XR_ERROR_VALIDATION_FAILURE, formatString("%s has type %d, expected %d", name, object->type, type));
}

template <typename Struct>
void allowType(const Struct* object, XrStructureType type, const char* name) // null is well, too
{
    if (object != nullptr)
        requireType(object, type, name);
}

template <typename Pointer>
void requirePointer(Pointer pointer, const char* name)
{
    if (pointer == nullptr)
        refuse(XR_ERROR_VALIDATION_FAILURE, std::string(name) + " is null");
}

template <typename Struct>
const Struct* chained(const void* next, XrStructureType type)
{
    for (auto* at = static_cast<const XrBaseInStructure*>(next); at != nullptr; at = at->next)
        if (at->type == type)
            return reinterpret_cast<const Struct*>(at);
    return nullptr;
}

template <typename Struct>
Struct* chainedOut(void* next, XrStructureType type)
{
    return const_cast<Struct*>(chained<Struct>(next, type));
}

// OpenXR's call-twice rule.
template <typename Items, typename Item>
XrResult listOut(const Items& items, uint32_t capacity, uint32_t* count, Item* out)
{
    requirePointer(count, "the count");
    *count = uint32_t(items.size());
    if (capacity == 0)
        return XR_SUCCESS;
    if (capacity < items.size())
        refuse(XR_ERROR_SIZE_INSUFFICIENT, formatString("capacity %u, expected %zu", capacity, items.size()));
    requirePointer(out, "the list");
    std::copy(items.begin(), items.end(), out);
    return XR_SUCCESS;
}

enum class WhenLost { Refuse, Work }; // xrDestroy... and xrPollEvent work still

// Runs the body of an OpenXR function with the lock held. No exception may reach the application.
template <typename Body>
XrResult guarded(const char* function, WhenLost when_lost, Body body)
{
    Runtime& rt = runtime();
    std::unique_lock lock(rt.mutex);
    try {
        if (rt.instance_lost && when_lost == WhenLost::Refuse)
            refuse(XR_ERROR_INSTANCE_LOST, "the instance is lost");
        if constexpr (std::is_invocable_v<Body, Runtime&, std::unique_lock<std::mutex>&>)
            return body(rt, lock);
        else
            return body(rt);
    } catch (const Refused& refused) {
        return report(rt, function, refused.code, refused.why);
    } catch (const std::exception& e) {
        return report(rt, function, XR_ERROR_RUNTIME_FAILURE, e.what());
    }
}

template <typename Body>
XrResult guarded(const char* function, Body body)
{
    return guarded(function, WhenLost::Refuse, body);
}

template <typename Event>
void Runtime::send(const Event& event)
{
    static_assert(sizeof(Event) <= sizeof(XrEventDataBuffer));
    XrEventDataBuffer& buffer = events.emplace_back(XrEventDataBuffer{});
    std::memcpy(&buffer, &event, sizeof event);
}

} // namespace gsc::fake_xr
