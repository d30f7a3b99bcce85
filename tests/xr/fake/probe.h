// SPDX-License-Identifier: Apache-2.0
#pragma once

#define XR_USE_GRAPHICS_API_VULKAN
#define XR_USE_TIMESPEC
#include <vulkan/vulkan.h>

#include <ctime>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <openxr/openxr.h>
#include <openxr/openxr_platform.h>
#include <string>
#include <vector>

namespace gsc::fake_xr {

// One of OpenXR's structs, all else zero.
template <typename Info>
Info xrInfo(XrStructureType type, void* next = nullptr)
{
    Info info{};
    info.type = type;
    info.next = next;
    return info;
}

// A small OpenXR application of its own: it goes through the real loader and a real Vulkan driver to the fake runtime,
// and lets a test look at, or get wrong, each step. One at a time in a process. Failed calls throw std::runtime_error.
class Probe {
public:
    // The name is that of a fresh folder below the working folder, with settings.json and log.jsonl. The settings'
    // "log" is set; "dump": true stands for the folder.
    Probe(const std::string& name, nlohmann::json settings, std::vector<const char*> extensions = {});
    ~Probe();
    Probe(const Probe&) = delete;
    Probe& operator=(const Probe&) = delete;

    void openVulkan();
    void openSession();    // with openVulkan(), and with LOCAL
    void openSwapchains(); // one for each view, or an array of all views
    void closeSession();
    void begin(); // reads events up to READY, then xrBeginSession

    struct Frame {
        XrFrameState state = xrInfo<XrFrameState>(XR_TYPE_FRAME_STATE);
        std::vector<XrView> views;
        XrViewStateFlags flags = 0;
    };
    Frame waitAndBegin(); // and locates
    // Draws each view in its colour of frame and view, releases, and submits the frame's views as they were located.
    // edit may change what is submitted. Returns what xrEndFrame did.
    using Edit = std::function<void(std::vector<XrCompositionLayerProjectionView>&, XrCompositionLayerProjection&,
                                    XrFrameEndInfo&)>;
    XrResult end(const Frame& frame, const Edit& edit = {});
    void runFrame() { end(waitAndBegin()); }
    void draw(uint32_t swapchain, uint32_t number); // acquire, wait, clear, release

    std::vector<XrSessionState> readStates(); // all that wait; other events go to other_events
    std::vector<nlohmann::json> log() const;
    std::vector<nlohmann::json> logged(const char* key) const; // the lines that have it
    XrPath path(const char* text) const;
    static XrColor4f colorOf(uint32_t view, uint32_t number);

    template <typename Function>
    Function load(const char* name) const
    {
        PFN_xrVoidFunction found = nullptr;
        return XR_SUCCEEDED(xrGetInstanceProcAddr(instance, name, &found)) ? reinterpret_cast<Function>(found)
                                                                           : nullptr;
    }

    std::string folder;
    XrInstance instance = XR_NULL_HANDLE;
    XrSystemId system = XR_NULL_SYSTEM_ID;
    XrSession session = XR_NULL_HANDLE;
    XrSpace local = XR_NULL_HANDLE;
    XrViewConfigurationType configuration = XR_VIEW_CONFIGURATION_TYPE_PRIMARY_STEREO;
    std::vector<XrViewConfigurationView> sizes;
    struct Swapchain {
        XrSwapchain handle = XR_NULL_HANDLE;
        std::vector<XrSwapchainImageVulkan2KHR> images;
        XrSwapchainCreateInfo info;
    };
    std::vector<Swapchain> swapchains;
    std::vector<XrStructureType> other_events;
    bool array = false;
    int64_t format = VK_FORMAT_R8G8B8A8_SRGB;
    uint32_t frames = 0;

    VkInstance vulkan = VK_NULL_HANDLE;
    VkPhysicalDevice physical = VK_NULL_HANDLE;
    VkDevice device = VK_NULL_HANDLE;
    XrGraphicsBindingVulkan2KHR binding = xrInfo<XrGraphicsBindingVulkan2KHR>(XR_TYPE_GRAPHICS_BINDING_VULKAN2_KHR);

private:
    void clear(VkImage image, uint32_t layer, const XrColor4f& color);

    VkQueue m_queue = VK_NULL_HANDLE;
    VkCommandPool m_pool = VK_NULL_HANDLE;
    VkCommandBuffer m_commands = VK_NULL_HANDLE;
};

void must(XrResult result, const char* what); // throws if it failed

using States = std::vector<XrSessionState>;

// The settings with two views of 64x48.
nlohmann::json smallViews(nlohmann::json settings = nlohmann::json::object());
// A session that runs, with swapchains.
void start(Probe& probe);

} // namespace gsc::fake_xr
