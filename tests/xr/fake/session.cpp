// SPDX-License-Identifier: Apache-2.0
#include "session.h"

#include "functions.h"
#include "system.h"

namespace gsc::fake_xr {

namespace {

// From any running state down to STOPPING. Frames go on until xrEndSession.
void stop(Runtime& rt)
{
    const XrSessionState from = rt.session->state;
    if (from == XR_SESSION_STATE_STOPPING)
        return;
    if (from == XR_SESSION_STATE_FOCUSED)
        rt.setState(XR_SESSION_STATE_VISIBLE);
    if (from != XR_SESSION_STATE_SYNCHRONIZED)
        rt.setState(XR_SESSION_STATE_SYNCHRONIZED);
    rt.setState(XR_SESSION_STATE_STOPPING);
}

void hide(Runtime& rt)
{
    if (rt.session->state == XR_SESSION_STATE_FOCUSED)
        rt.setState(XR_SESSION_STATE_VISIBLE);
    if (rt.session->state == XR_SESSION_STATE_VISIBLE)
        rt.setState(XR_SESSION_STATE_SYNCHRONIZED);
}

void focus(Runtime& rt)
{
    if (rt.session->state == XR_SESSION_STATE_SYNCHRONIZED)
        rt.setState(XR_SESSION_STATE_VISIBLE);
    if (rt.session->state == XR_SESSION_STATE_VISIBLE)
        rt.setState(XR_SESSION_STATE_FOCUSED);
}

void loseInstance(Runtime& rt)
{
    rt.send(XrEventDataInstanceLossPending{XR_TYPE_EVENT_DATA_INSTANCE_LOSS_PENDING, nullptr, rt.now()});
    rt.log.line(R"({"event":"instance_loss_pending"})");
    rt.instance_lost = true;
    refuse(XR_ERROR_INSTANCE_LOST, "the settings' events say so");
}

// With the extension, an event for each view whose mask is another now.
void changeMasks(Runtime& rt, const Masks& masks)
{
    if (!rt.enabled(XR_KHR_VISIBILITY_MASK_EXTENSION_NAME))
        return;
    for (const auto& [view, mask] : masks) {
        (*rt.settings.visibility_mask)[view] = mask;
        rt.send(XrEventDataVisibilityMaskChangedKHR{XR_TYPE_EVENT_DATA_VISIBILITY_MASK_CHANGED_KHR, nullptr,
                                                    handleOf<XrSession>(rt.session->id), rt.session->configuration,
                                                    view});
        rt.log.line(formatString(R"({"event":"visibility_mask_changed","view":%u,"frame":%lld})", view,
                                 static_cast<long long>(rt.frames - 1)));
    }
}

void play(Runtime& rt, const ScriptedEvent& event)
{
    const std::string& what = event.what;
    Session& session = *rt.session;
    if (what == "hide")
        hide(rt);
    else if (what == "show" || what == "focus")
        focus(rt);
    else if (what == "unfocus" && session.state == XR_SESSION_STATE_FOCUSED)
        rt.setState(XR_SESSION_STATE_VISIBLE);
    else if (what == "stop" || what == "exit")
        stop(rt);
    if (what == "exit")
        session.exiting = true;
    if (what == "mask")
        changeMasks(rt, event.masks);
    if (what == "loss_pending") {
        rt.setState(XR_SESSION_STATE_LOSS_PENDING);
        session.lost = true; // this xrWaitFrame still succeeds
    }
    if (what == "session_lost") {
        session.lost = true;
        refuse(XR_ERROR_SESSION_LOST, "the settings' events say so");
    }
    if (what == "instance_lost")
        loseInstance(rt);
}

void checkBinding(const Runtime& rt, const XrGraphicsBindingVulkan2KHR& binding)
{
    const VulkanObjects& vulkan = rt.vulkan;
    if (!vulkan.requirements_asked)
        refuse(XR_ERROR_GRAPHICS_REQUIREMENTS_CALL_MISSING, "xrGetVulkanGraphicsRequirements2KHR was not called");
    const auto requireSame = [](auto given, auto known, const char* name) {
        if (given == VK_NULL_HANDLE || given != known)
            refuse(XR_ERROR_GRAPHICS_DEVICE_INVALID, std::string(name) + " is not the one made with the runtime");
    };
    requireSame(binding.instance, vulkan.instance, "instance");
    requireSame(binding.physicalDevice, vulkan.physical, "physicalDevice");
    requireSame(binding.device, vulkan.device, "device");
    const auto family = vulkan.queues.find(binding.queueFamilyIndex);
    if (family == vulkan.queues.end() || binding.queueIndex >= family->second)
        refuse(XR_ERROR_GRAPHICS_DEVICE_INVALID,
               formatString("the device has no queue %u of family %u", binding.queueIndex, binding.queueFamilyIndex));
}

} // namespace

void playEvents(Runtime& rt, int64_t frame)
{
    const std::vector<ScriptedEvent>& events = rt.settings.events;
    while (rt.next_event < events.size() && events[rt.next_event].frame <= frame) {
        const ScriptedEvent& event = events[rt.next_event];
        if (event.what == "restart" && rt.session->state == XR_SESSION_STATE_STOPPING)
            return; // it waits for xrEndSession
        ++rt.next_event;
        play(rt, event);
    }
}

void becomeFocused(Runtime& rt)
{
    for (const XrSessionState state :
         {XR_SESSION_STATE_SYNCHRONIZED, XR_SESSION_STATE_VISIBLE, XR_SESSION_STATE_FOCUSED})
        rt.setState(state);
}

void watchThread(Runtime& rt, Session& session, const char* function)
{
    const std::thread::id self = std::this_thread::get_id();
    if (session.frame_thread == std::thread::id())
        session.frame_thread = self;
    if (session.frame_thread != self && session.other_thread_reported.insert(function).second)
        report(rt, function, XR_ERROR_VALIDATION_FAILURE, "frame and swapchain calls come from two threads");
}

void destroySession(Runtime& rt)
{
    if (!rt.session)
        return;
    for (auto& [id, swapchain] : rt.session->swapchains)
        rt.session->gpu->destroyImages(swapchain.images);
    rt.session.reset();
    rt.actions.attached.clear();
    rt.actions.profile_announced = false;
    rt.changed.notify_all();
}

XrResult xrCreateSession(XrInstance instance, const XrSessionCreateInfo* info, XrSession* out)
{
    return guarded("xrCreateSession", [&](Runtime& rt) {
        requireType(info, XR_TYPE_SESSION_CREATE_INFO, "createInfo");
        rt.requireSystem(instance, info->systemId);
        requirePointer(out, "session");
        if (rt.session)
            refuse(XR_ERROR_LIMIT_REACHED, "there is a session already");
        const auto* binding = chained<XrGraphicsBindingVulkan2KHR>(info->next, XR_TYPE_GRAPHICS_BINDING_VULKAN2_KHR);
        auto session = std::make_unique<Session>();
        if (binding != nullptr && rt.enabled(XR_KHR_VULKAN_ENABLE2_EXTENSION_NAME)) {
            checkBinding(rt, *binding);
            session->gpu = std::make_unique<Gpu>(rt.vulkan.loader, *binding);
        } else if (!rt.enabled(XR_MND_HEADLESS_EXTENSION_NAME)) {
            refuse(XR_ERROR_GRAPHICS_DEVICE_INVALID, "no graphics binding of an enabled extension");
        }
        session->id = rt.next_id++;
        session->located.resize(rt.settings.views.size());
        rt.session = std::move(session);
        rt.setState(XR_SESSION_STATE_IDLE);
        rt.setState(XR_SESSION_STATE_READY);
        *out = handleOf<XrSession>(rt.session->id);
        return XR_SUCCESS;
    });
}

XrResult xrDestroySession(XrSession handle)
{
    return guarded("xrDestroySession", WhenLost::Work, [&](Runtime& rt) {
        if (!rt.session || idOf(handle) != rt.session->id)
            refuse(XR_ERROR_HANDLE_INVALID, "no such session");
        destroySession(rt);
        return XR_SUCCESS;
    });
}

XrResult xrBeginSession(XrSession handle, const XrSessionBeginInfo* info)
{
    return guarded("xrBeginSession", [&](Runtime& rt) {
        Session& session = rt.requireSession(handle);
        requireType(info, XR_TYPE_SESSION_BEGIN_INFO, "beginInfo");
        if (session.running)
            refuse(XR_ERROR_SESSION_RUNNING, "the session runs already");
        if (session.state != XR_SESSION_STATE_READY)
            refuse(XR_ERROR_SESSION_NOT_READY,
                   formatString("the session's state is %d, expected READY", session.state));
        requireConfiguration(rt, info->primaryViewConfigurationType);
        session.configuration = info->primaryViewConfigurationType;
        session.running = true;
        session.waited.reset();
        session.begun.reset();
        session.last_refresh.reset();
        session.frame_thread = {}; // another one may run these frames
        if (!session.gpu)          // no frames will come
            becomeFocused(rt);
        return XR_SUCCESS;
    });
}

XrResult xrEndSession(XrSession handle)
{
    return guarded("xrEndSession", [&](Runtime& rt) {
        Session& session = rt.requireRunning(handle);
        if (session.state != XR_SESSION_STATE_STOPPING)
            refuse(XR_ERROR_SESSION_NOT_STOPPING,
                   formatString("the session's state is %d, expected STOPPING", session.state));
        session.running = false;
        rt.changed.notify_all();
        rt.setState(XR_SESSION_STATE_IDLE);
        if (session.exiting) {
            rt.setState(XR_SESSION_STATE_EXITING);
            return XR_SUCCESS;
        }
        const std::vector<ScriptedEvent>& events = rt.settings.events;
        if (rt.next_event < events.size() && events[rt.next_event].what == "restart")
            session.polls_to_restart = std::max(1u, events[rt.next_event++].polls);
        return XR_SUCCESS;
    });
}

XrResult xrRequestExitSession(XrSession handle)
{
    return guarded("xrRequestExitSession", [&](Runtime& rt) {
        Session& session = rt.requireRunning(handle);
        rt.log.line(R"({"event":"exit_requested"})");
        stop(rt);
        session.exiting = true;
        return XR_SUCCESS;
    });
}

} // namespace gsc::fake_xr
