// SPDX-License-Identifier: Apache-2.0
#include "probe.h"

#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <stdexcept>

namespace gsc::fake_xr {

namespace {

using nlohmann::json;

void must(VkResult result, const char* what)
{
    if (result != VK_SUCCESS)
        throw std::runtime_error(std::string(what) + " gave " + std::to_string(result));
}

} // namespace

void must(XrResult result, const char* what)
{
    if (XR_FAILED(result))
        throw std::runtime_error(std::string(what) + " gave " + std::to_string(result));
}

json smallViews(json settings)
{
    const json view{{"width", 64}, {"height", 48}};
    settings["views"] = {view, view};
    return settings;
}

void start(Probe& probe)
{
    probe.openSession();
    probe.openSwapchains();
    probe.begin();
}

Probe::Probe(const std::string& name, json settings, std::vector<const char*> extensions)
    : folder(std::filesystem::absolute("fake_xr_" + name))
{
    std::filesystem::remove_all(folder);
    std::filesystem::create_directories(folder);
    settings["log"] = folder + "/log.jsonl";
    if (settings.contains("dump"))
        settings["dump"] = folder;
    std::ofstream(folder + "/settings.json") << settings;
    setenv("GSC_FAKE_XR", (folder + "/settings.json").c_str(), 1);

    auto info = xrInfo<XrInstanceCreateInfo>(XR_TYPE_INSTANCE_CREATE_INFO);
    std::strcpy(info.applicationInfo.applicationName, "test_fake_xr");
    info.applicationInfo.apiVersion = XR_MAKE_VERSION(1, 0, 0);
    extensions.push_back(XR_KHR_VULKAN_ENABLE2_EXTENSION_NAME);
    info.enabledExtensionCount = uint32_t(extensions.size());
    info.enabledExtensionNames = extensions.data();
    must(xrCreateInstance(&info, &instance), "xrCreateInstance");
    auto get = xrInfo<XrSystemGetInfo>(XR_TYPE_SYSTEM_GET_INFO);
    get.formFactor = XR_FORM_FACTOR_HEAD_MOUNTED_DISPLAY;
    if (XR_FAILED(xrGetSystem(instance, &get, &system)))
        return;                                  // a test may want that
    XrViewConfigurationType configurations[4]{}; // the best first
    uint32_t count = 0;
    xrEnumerateViewConfigurations(instance, system, 4, &count, configurations);
    configuration = configurations[0];
}

Probe::~Probe()
{
    closeSession();
    if (device != VK_NULL_HANDLE) {
        vkDeviceWaitIdle(device);
        vkDestroyCommandPool(device, m_pool, nullptr);
        vkDestroyDevice(device, nullptr);
    }
    if (vulkan != VK_NULL_HANDLE)
        vkDestroyInstance(vulkan, nullptr);
    if (instance != XR_NULL_HANDLE)
        xrDestroyInstance(instance);
}

void Probe::openVulkan()
{
    auto needs = xrInfo<XrGraphicsRequirementsVulkan2KHR>(XR_TYPE_GRAPHICS_REQUIREMENTS_VULKAN2_KHR);
    must(load<PFN_xrGetVulkanGraphicsRequirements2KHR>("xrGetVulkanGraphicsRequirements2KHR")(instance, system, &needs),
         "xrGetVulkanGraphicsRequirements2KHR");
    VkApplicationInfo application{};
    application.sType = VK_STRUCTURE_TYPE_APPLICATION_INFO;
    application.apiVersion = VK_API_VERSION_1_2;
    VkInstanceCreateInfo instance_info{};
    instance_info.sType = VK_STRUCTURE_TYPE_INSTANCE_CREATE_INFO;
    instance_info.pApplicationInfo = &application;
    auto create = xrInfo<XrVulkanInstanceCreateInfoKHR>(XR_TYPE_VULKAN_INSTANCE_CREATE_INFO_KHR);
    create.systemId = system;
    create.pfnGetInstanceProcAddr = vkGetInstanceProcAddr;
    create.vulkanCreateInfo = &instance_info;
    VkResult result = VK_SUCCESS;
    must(load<PFN_xrCreateVulkanInstanceKHR>("xrCreateVulkanInstanceKHR")(instance, &create, &vulkan, &result),
         "xrCreateVulkanInstanceKHR");
    must(result, "vkCreateInstance");
    auto get = xrInfo<XrVulkanGraphicsDeviceGetInfoKHR>(XR_TYPE_VULKAN_GRAPHICS_DEVICE_GET_INFO_KHR);
    get.systemId = system;
    get.vulkanInstance = vulkan;
    must(load<PFN_xrGetVulkanGraphicsDevice2KHR>("xrGetVulkanGraphicsDevice2KHR")(instance, &get, &physical),
         "xrGetVulkanGraphicsDevice2KHR");
    const float priority = 1;
    VkDeviceQueueCreateInfo queue{};
    queue.sType = VK_STRUCTURE_TYPE_DEVICE_QUEUE_CREATE_INFO;
    queue.queueCount = 1;
    queue.pQueuePriorities = &priority;
    VkDeviceCreateInfo device_info{};
    device_info.sType = VK_STRUCTURE_TYPE_DEVICE_CREATE_INFO;
    device_info.queueCreateInfoCount = 1;
    device_info.pQueueCreateInfos = &queue;
    auto create_device = xrInfo<XrVulkanDeviceCreateInfoKHR>(XR_TYPE_VULKAN_DEVICE_CREATE_INFO_KHR);
    create_device.systemId = system;
    create_device.pfnGetInstanceProcAddr = vkGetInstanceProcAddr;
    create_device.vulkanPhysicalDevice = physical;
    create_device.vulkanCreateInfo = &device_info;
    must(load<PFN_xrCreateVulkanDeviceKHR>("xrCreateVulkanDeviceKHR")(instance, &create_device, &device, &result),
         "xrCreateVulkanDeviceKHR");
    must(result, "vkCreateDevice");
    vkGetDeviceQueue(device, 0, 0, &m_queue);
    VkCommandPoolCreateInfo pool{};
    pool.sType = VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO;
    pool.flags = VK_COMMAND_POOL_CREATE_RESET_COMMAND_BUFFER_BIT;
    must(vkCreateCommandPool(device, &pool, nullptr, &m_pool), "vkCreateCommandPool");
    VkCommandBufferAllocateInfo commands{};
    commands.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO;
    commands.commandPool = m_pool;
    commands.commandBufferCount = 1;
    must(vkAllocateCommandBuffers(device, &commands, &m_commands), "vkAllocateCommandBuffers");
    binding.instance = vulkan;
    binding.physicalDevice = physical;
    binding.device = device;
}

void Probe::openSession()
{
    if (device == VK_NULL_HANDLE)
        openVulkan();
    XrSessionCreateInfo info{XR_TYPE_SESSION_CREATE_INFO, &binding, 0, system};
    must(xrCreateSession(instance, &info, &session), "xrCreateSession");
    auto space = xrInfo<XrReferenceSpaceCreateInfo>(XR_TYPE_REFERENCE_SPACE_CREATE_INFO);
    space.referenceSpaceType = XR_REFERENCE_SPACE_TYPE_LOCAL;
    space.poseInReferenceSpace.orientation.w = 1;
    must(xrCreateReferenceSpace(session, &space, &local), "xrCreateReferenceSpace");
}

void Probe::openSwapchains()
{
    uint32_t count = 0;
    must(xrEnumerateViewConfigurationViews(instance, system, configuration, 0, &count, nullptr), "the views");
    sizes.assign(count, xrInfo<XrViewConfigurationView>(XR_TYPE_VIEW_CONFIGURATION_VIEW));
    must(xrEnumerateViewConfigurationViews(instance, system, configuration, count, &count, sizes.data()), "the views");
    for (const XrViewConfigurationView& size : sizes) {
        Swapchain& made = swapchains.emplace_back();
        made.info = xrInfo<XrSwapchainCreateInfo>(XR_TYPE_SWAPCHAIN_CREATE_INFO);
        made.info.usageFlags = XR_SWAPCHAIN_USAGE_COLOR_ATTACHMENT_BIT | XR_SWAPCHAIN_USAGE_TRANSFER_DST_BIT;
        made.info.format = format;
        made.info.width = size.recommendedImageRectWidth;
        made.info.height = size.recommendedImageRectHeight;
        made.info.sampleCount = made.info.faceCount = made.info.mipCount = 1;
        made.info.arraySize = array ? uint32_t(sizes.size()) : 1;
        must(xrCreateSwapchain(session, &made.info, &made.handle), "xrCreateSwapchain");
        must(xrEnumerateSwapchainImages(made.handle, 0, &count, nullptr), "xrEnumerateSwapchainImages");
        made.images.assign(count, xrInfo<XrSwapchainImageVulkan2KHR>(XR_TYPE_SWAPCHAIN_IMAGE_VULKAN2_KHR));
        auto* images = reinterpret_cast<XrSwapchainImageBaseHeader*>(made.images.data());
        must(xrEnumerateSwapchainImages(made.handle, count, &count, images), "xrEnumerateSwapchainImages");
        if (array)
            return;
    }
}

void Probe::closeSession()
{
    if (session == XR_NULL_HANDLE)
        return;
    for (const Swapchain& each : swapchains)
        xrDestroySwapchain(each.handle);
    swapchains.clear();
    xrDestroySpace(local);
    xrDestroySession(session);
    session = XR_NULL_HANDLE;
}

void Probe::begin()
{
    const std::vector<XrSessionState> states = readStates();
    if (states.empty() || states.back() != XR_SESSION_STATE_READY)
        throw std::runtime_error("the session is not ready");
    const XrSessionBeginInfo info{XR_TYPE_SESSION_BEGIN_INFO, nullptr, configuration};
    must(xrBeginSession(session, &info), "xrBeginSession");
}

Probe::Frame Probe::waitAndBegin()
{
    Frame frame;
    must(xrWaitFrame(session, nullptr, &frame.state), "xrWaitFrame");
    must(xrBeginFrame(session, nullptr), "xrBeginFrame");
    ++frames;
    const XrViewLocateInfo info{XR_TYPE_VIEW_LOCATE_INFO, nullptr, configuration, frame.state.predictedDisplayTime,
                                local};
    auto state = xrInfo<XrViewState>(XR_TYPE_VIEW_STATE);
    uint32_t count = 0;
    must(xrLocateViews(session, &info, &state, 0, &count, nullptr), "xrLocateViews");
    frame.views.assign(count, xrInfo<XrView>(XR_TYPE_VIEW));
    must(xrLocateViews(session, &info, &state, count, &count, frame.views.data()), "xrLocateViews");
    frame.flags = state.viewStateFlags;
    return frame;
}

XrColor4f Probe::colorOf(uint32_t view, uint32_t number)
{
    return {float(view % 2), float(number % 2), 1 - float(view % 2), 1}; // 0 and 1 are the same bytes in sRGB
}

void Probe::clear(VkImage image, uint32_t layer, const XrColor4f& color)
{
    VkCommandBufferBeginInfo begin_info{};
    begin_info.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO;
    must(vkBeginCommandBuffer(m_commands, &begin_info), "vkBeginCommandBuffer");
    VkImageMemoryBarrier barrier{};
    barrier.sType = VK_STRUCTURE_TYPE_IMAGE_MEMORY_BARRIER;
    barrier.srcAccessMask = VK_ACCESS_MEMORY_WRITE_BIT;
    barrier.dstAccessMask = VK_ACCESS_MEMORY_READ_BIT | VK_ACCESS_MEMORY_WRITE_BIT;
    barrier.oldLayout = VK_IMAGE_LAYOUT_COLOR_ATTACHMENT_OPTIMAL;
    barrier.newLayout = VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL;
    barrier.srcQueueFamilyIndex = barrier.dstQueueFamilyIndex = VK_QUEUE_FAMILY_IGNORED;
    barrier.image = image;
    barrier.subresourceRange = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 1, layer, 1};
    constexpr VkPipelineStageFlags kAll = VK_PIPELINE_STAGE_ALL_COMMANDS_BIT;
    vkCmdPipelineBarrier(m_commands, kAll, kAll, 0, 0, nullptr, 0, nullptr, 1, &barrier);
    const VkClearColorValue value{{color.r, color.g, color.b, color.a}};
    vkCmdClearColorImage(m_commands, image, barrier.newLayout, &value, 1, &barrier.subresourceRange);
    std::swap(barrier.oldLayout, barrier.newLayout);
    vkCmdPipelineBarrier(m_commands, kAll, kAll, 0, 0, nullptr, 0, nullptr, 1, &barrier);
    must(vkEndCommandBuffer(m_commands), "vkEndCommandBuffer");
    VkSubmitInfo submit{};
    submit.sType = VK_STRUCTURE_TYPE_SUBMIT_INFO;
    submit.commandBufferCount = 1;
    submit.pCommandBuffers = &m_commands;
    must(vkQueueSubmit(m_queue, 1, &submit, VK_NULL_HANDLE), "vkQueueSubmit");
    must(vkQueueWaitIdle(m_queue), "vkQueueWaitIdle");
}

void Probe::draw(uint32_t swapchain, uint32_t number)
{
    const Swapchain& drawn = swapchains[swapchain];
    uint32_t index = 0;
    must(xrAcquireSwapchainImage(drawn.handle, nullptr, &index), "xrAcquireSwapchainImage");
    const XrSwapchainImageWaitInfo wait{XR_TYPE_SWAPCHAIN_IMAGE_WAIT_INFO, nullptr, XR_INFINITE_DURATION};
    must(xrWaitSwapchainImage(drawn.handle, &wait), "xrWaitSwapchainImage");
    for (uint32_t layer = 0; layer < drawn.info.arraySize; ++layer)
        clear(drawn.images[index].image, layer, colorOf(swapchain + layer, number));
    must(xrReleaseSwapchainImage(drawn.handle, nullptr), "xrReleaseSwapchainImage");
}

XrResult Probe::end(const Frame& frame, const Edit& edit)
{
    std::vector<XrCompositionLayerProjectionView> views;
    const bool drawn = frame.state.shouldRender && frame.flags != 0;
    for (uint32_t i = 0; drawn && i < swapchains.size(); ++i)
        draw(i, frames - 1);
    for (uint32_t i = 0; drawn && i < sizes.size(); ++i) {
        const Swapchain& swapchain = swapchains[array ? 0 : i];
        const XrExtent2Di size{int(swapchain.info.width), int(swapchain.info.height)};
        views.push_back({XR_TYPE_COMPOSITION_LAYER_PROJECTION_VIEW,
                         nullptr,
                         frame.views[i].pose,
                         frame.views[i].fov,
                         {swapchain.handle, {{0, 0}, size}, array ? i : 0}});
    }
    auto layer = xrInfo<XrCompositionLayerProjection>(XR_TYPE_COMPOSITION_LAYER_PROJECTION);
    layer.space = local;
    layer.viewCount = uint32_t(views.size());
    layer.views = views.data();
    const XrCompositionLayerBaseHeader* layers[] = {reinterpret_cast<XrCompositionLayerBaseHeader*>(&layer)};
    auto info = xrInfo<XrFrameEndInfo>(XR_TYPE_FRAME_END_INFO);
    info.displayTime = frame.state.predictedDisplayTime;
    info.environmentBlendMode = XR_ENVIRONMENT_BLEND_MODE_OPAQUE;
    info.layerCount = views.empty() ? 0 : 1;
    info.layers = layers;
    if (edit)
        edit(views, layer, info);
    return xrEndFrame(session, &info);
}

std::vector<XrSessionState> Probe::readStates()
{
    std::vector<XrSessionState> states;
    auto event = xrInfo<XrEventDataBuffer>(XR_TYPE_EVENT_DATA_BUFFER);
    while (xrPollEvent(instance, &event) == XR_SUCCESS) {
        if (event.type == XR_TYPE_EVENT_DATA_SESSION_STATE_CHANGED) {
            XrEventDataSessionStateChanged change;
            std::memcpy(&change, &event, sizeof change);
            states.push_back(change.state);
        } else {
            other_events.push_back(event.type);
        }
        event = xrInfo<XrEventDataBuffer>(XR_TYPE_EVENT_DATA_BUFFER);
    }
    return states;
}

std::vector<json> Probe::log() const
{
    std::ifstream file(folder + "/log.jsonl");
    std::vector<json> lines;
    for (std::string line; std::getline(file, line);)
        lines.push_back(json::parse(line));
    return lines;
}

std::vector<json> Probe::logged(const char* key) const
{
    std::vector<json> lines = log();
    std::erase_if(lines, [&](const json& line) { return !line.contains(key); });
    return lines;
}

XrPath Probe::path(const char* text) const
{
    XrPath made = XR_NULL_PATH;
    must(xrStringToPath(instance, text, &made), "xrStringToPath");
    return made;
}

} // namespace gsc::fake_xr
