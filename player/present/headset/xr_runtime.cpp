// SPDX-License-Identifier: Apache-2.0
#include "player/present/headset/xr_runtime.h"

#include <gsc/error.h>

#include <dlfcn.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <filesystem>

namespace gsc {

namespace {

constexpr const char* kOptional[] = {XR_EXT_EYE_GAZE_INTERACTION_EXTENSION_NAME, XR_VARJO_QUAD_VIEWS_EXTENSION_NAME,
                                     XR_KHR_VISIBILITY_MASK_EXTENSION_NAME,
                                     XR_KHR_CONVERT_TIMESPEC_TIME_EXTENSION_NAME};

struct NamedConfiguration {
    XrViewConfigurationType type;
    const char* name;
};
constexpr NamedConfiguration kConfigurations[] = {
    {XR_VIEW_CONFIGURATION_TYPE_PRIMARY_STEREO, "stereo"},
    {XR_VIEW_CONFIGURATION_TYPE_PRIMARY_QUAD_VARJO, "quad"},
    {XR_VIEW_CONFIGURATION_TYPE_PRIMARY_MONO, "mono"},
};

std::string versionText(XrVersion version)
{
    return formatString("%u.%u.%u", unsigned(XR_VERSION_MAJOR(version)), unsigned(XR_VERSION_MINOR(version)),
                        unsigned(XR_VERSION_PATCH(version)));
}

// Returns the file name, which ends in the version, of the library that `function` is in.
std::string libraryOf(const void* function)
{
    Dl_info info{};
    if (dladdr(function, &info) == 0 || info.dli_fname == nullptr)
        return "unknown";
    std::error_code error;
    const std::filesystem::path file = std::filesystem::canonical(info.dli_fname, error);
    return (error ? std::filesystem::path(info.dli_fname) : file).filename().string();
}

std::string vulkanName()
{
    uint32_t version = VK_API_VERSION_1_0;
    vkEnumerateInstanceVersion(&version);
    return formatString("%u.%u.%u, %s", VK_API_VERSION_MAJOR(version), VK_API_VERSION_MINOR(version),
                        VK_API_VERSION_PATCH(version),
                        libraryOf(reinterpret_cast<const void*>(&vkCreateInstance)).c_str());
}

// Name of the GPU that Vulkan finds without a headset, or the reason why there is none.
std::string gpuOfVulkan(const std::optional<DeviceUuid>& uuid)
{
    try {
        VulkanDeviceOptions options;
        options.uuid = uuid;
        VulkanDevice device(options);
        device.open(VK_NULL_HANDLE);
        return device.name;
    } catch (const Error& e) {
        return "none: " + e.found();
    }
}

uint32_t scaled(uint32_t size, uint32_t most, double scale)
{
    return std::clamp(uint32_t(std::lround(size * scale)), 16u, std::max(most, 16u));
}

} // namespace

XrRuntime::XrRuntime(const HeadsetOptions& options)
{
    setenv("XR_LOADER_DEBUG", "none", 0); // silent: the errors below say what the loader would print
    facts.loader = libraryOf(reinterpret_cast<const void*>(&xrCreateInstance));
    facts.vulkan = vulkanName();
    try {
        makeInstance(options.depth);
        findHeadset();
        chooseViews(options.scale);
        makeDevice(options.device);
    } catch (...) { // a destructor does not run if the constructor throws
        device.reset();
        if (instance != XR_NULL_HANDLE)
            xrDestroyInstance(instance);
        if (options.known != nullptr) {
            facts.gpu = gpuOfVulkan(options.device);
            *options.known = facts;
        }
        throw;
    }
}

XrRuntime::~XrRuntime()
{
    device.reset();
    xrDestroyInstance(instance);
}

bool XrRuntime::has(const char* extension) const
{
    return std::ranges::any_of(m_extensions, [&](const char* on) { return std::strcmp(on, extension) == 0; });
}

void XrRuntime::makeInstance(bool depth)
{
    const auto there =
        xrList("xrEnumerateInstanceExtensionProperties", xrInfo<XrExtensionProperties>(XR_TYPE_EXTENSION_PROPERTIES),
               [](uint32_t n, uint32_t* count, auto* items) {
                   return xrEnumerateInstanceExtensionProperties(nullptr, n, count, items);
               });
    const auto offered = [&](const char* name) {
        return std::ranges::any_of(there, [&](const auto& e) { return std::strcmp(e.extensionName, name) == 0; });
    };
    if (!offered(XR_KHR_VULKAN_ENABLE2_EXTENSION_NAME))
        throw Error(ErrorCode::Unsupported, "headset", "the OpenXR runtime takes no pictures of Vulkan's",
                    "the extension XR_KHR_vulkan_enable2", "update it, or use another runtime");
    m_extensions = {XR_KHR_VULKAN_ENABLE2_EXTENSION_NAME};
    for (const char* name : kOptional)
        if (offered(name))
            m_extensions.push_back(name);
    if (depth && offered(XR_KHR_COMPOSITION_LAYER_DEPTH_EXTENSION_NAME))
        m_extensions.push_back(XR_KHR_COMPOSITION_LAYER_DEPTH_EXTENSION_NAME);
    facts.extensions.assign(m_extensions.begin(), m_extensions.end());
    facts.tells_mask = has(XR_KHR_VISIBILITY_MASK_EXTENSION_NAME);

    auto info = xrInfo<XrInstanceCreateInfo>(XR_TYPE_INSTANCE_CREATE_INFO);
    setXrText(info.applicationInfo.applicationName, "gsc-play");
    setXrText(info.applicationInfo.engineName, "gsc");
    // only OpenXR 1.0 is used, which every runtime has
    info.applicationInfo.apiVersion = XR_MAKE_VERSION(1, 0, XR_VERSION_PATCH(XR_CURRENT_API_VERSION));
    info.enabledExtensionCount = uint32_t(m_extensions.size());
    info.enabledExtensionNames = m_extensions.data();
    checkXrStart(xrCreateInstance(&info, &instance), "xrCreateInstance");
    auto properties = xrInfo<XrInstanceProperties>(XR_TYPE_INSTANCE_PROPERTIES);
    checkXr(xrGetInstanceProperties(instance, &properties), "xrGetInstanceProperties");
    facts.runtime = std::string(properties.runtimeName) + " " + versionText(properties.runtimeVersion);
}

void XrRuntime::findHeadset()
{
    auto wanted = xrInfo<XrSystemGetInfo>(XR_TYPE_SYSTEM_GET_INFO);
    wanted.formFactor = XR_FORM_FACTOR_HEAD_MOUNTED_DISPLAY;
    checkXrStart(xrGetSystem(instance, &wanted, &system), "xrGetSystem");
    auto gaze = xrInfo<XrSystemEyeGazeInteractionPropertiesEXT>(XR_TYPE_SYSTEM_EYE_GAZE_INTERACTION_PROPERTIES_EXT);
    auto properties = xrInfo<XrSystemProperties>(XR_TYPE_SYSTEM_PROPERTIES);
    if (has(XR_EXT_EYE_GAZE_INTERACTION_EXTENSION_NAME))
        properties.next = &gaze;
    checkXr(xrGetSystemProperties(instance, system, &properties), "xrGetSystemProperties");
    facts.headset = properties.systemName;
    facts.tracks_gaze = tracks_gaze = gaze.supportsEyeGazeInteraction == XR_TRUE;
}

// Chooses the kind of views: the first known one in the runtime's list, which is in the runtime's order of preference.
void XrRuntime::chooseViews(double scale)
{
    const auto offered = xrList("xrEnumerateViewConfigurations", XrViewConfigurationType{},
                                [this](uint32_t n, uint32_t* count, XrViewConfigurationType* items) {
                                    return xrEnumerateViewConfigurations(instance, system, n, count, items);
                                });
    const NamedConfiguration* chosen = nullptr;
    for (const XrViewConfigurationType type : offered) {
        const auto* const known =
            std::ranges::find_if(kConfigurations, [&](const auto& each) { return each.type == type; });
        if (chosen == nullptr && known != std::end(kConfigurations))
            chosen = known;
    }
    if (chosen == nullptr)
        throw Error(ErrorCode::Unsupported, "headset", "the OpenXR runtime shows no kind of views that is known",
                    "one, two or four", "update it, or use another runtime");
    configuration = chosen->type;
    facts.configuration = chosen->name;
    const auto views =
        xrList("xrEnumerateViewConfigurationViews", xrInfo<XrViewConfigurationView>(XR_TYPE_VIEW_CONFIGURATION_VIEW),
               [this](uint32_t n, uint32_t* count, auto* items) {
                   return xrEnumerateViewConfigurationViews(instance, system, configuration, n, count, items);
               });
    for (const XrViewConfigurationView& view : views) {
        HeadsetView& each = facts.views.emplace_back();
        each.recommended_width = view.recommendedImageRectWidth;
        each.recommended_height = view.recommendedImageRectHeight;
        each.most_width = view.maxImageRectWidth;
        each.most_height = view.maxImageRectHeight;
        each.width = scaled(each.recommended_width, each.most_width, scale);
        each.height = scaled(each.recommended_height, each.most_height, scale);
    }
    const auto blends =
        xrList("xrEnumerateEnvironmentBlendModes", XrEnvironmentBlendMode{},
               [this](uint32_t n, uint32_t* count, XrEnvironmentBlendMode* items) {
                   return xrEnumerateEnvironmentBlendModes(instance, system, configuration, n, count, items);
               });
    if (std::ranges::find(blends, blend) == blends.end() && !blends.empty())
        blend = blends.front(); // takes the first mode, because see-through glasses have no opaque one
}

void XrRuntime::makeDevice(const std::optional<DeviceUuid>& uuid)
{
    auto needs = xrInfo<XrGraphicsRequirementsVulkan2KHR>(XR_TYPE_GRAPHICS_REQUIREMENTS_VULKAN2_KHR);
    checkXr(xrFunction<PFN_xrGetVulkanGraphicsRequirements2KHR>(instance, "xrGetVulkanGraphicsRequirements2KHR")(
                instance, system, &needs),
            "xrGetVulkanGraphicsRequirements2KHR");
    VulkanDeviceOptions options;
    options.uuid = uuid;
    const uint32_t least = VK_MAKE_API_VERSION(0, XR_VERSION_MAJOR(needs.minApiVersionSupported),
                                               XR_VERSION_MINOR(needs.minApiVersionSupported), 0);
    uint32_t there = 0;
    if (vkEnumerateInstanceVersion(&there) == VK_SUCCESS && there < least)
        throw Error(ErrorCode::Unsupported, "headset",
                    formatString("the OpenXR runtime wants Vulkan %u.%u", VK_API_VERSION_MAJOR(least),
                                 VK_API_VERSION_MINOR(least)),
                    formatString("at most the %u.%u that this machine's loader has", VK_API_VERSION_MAJOR(there),
                                 VK_API_VERSION_MINOR(there)),
                    "update Vulkan");
    options.version = std::max(options.version, least);
    VulkanMaker& maker = options.maker.emplace();
    maker.instance = [this](const VkInstanceCreateInfo& info, VkInstance* made) {
        auto create = xrInfo<XrVulkanInstanceCreateInfoKHR>(XR_TYPE_VULKAN_INSTANCE_CREATE_INFO_KHR);
        create.systemId = system;
        create.pfnGetInstanceProcAddr = vkGetInstanceProcAddr;
        create.vulkanCreateInfo = &info;
        VkResult result = VK_SUCCESS;
        checkXr(xrFunction<PFN_xrCreateVulkanInstanceKHR>(instance, "xrCreateVulkanInstanceKHR")(instance, &create,
                                                                                                 made, &result),
                "xrCreateVulkanInstanceKHR");
        return result;
    };
    maker.physical = [this](VkInstance vulkan) {
        auto get = xrInfo<XrVulkanGraphicsDeviceGetInfoKHR>(XR_TYPE_VULKAN_GRAPHICS_DEVICE_GET_INFO_KHR);
        get.systemId = system;
        get.vulkanInstance = vulkan;
        VkPhysicalDevice physical = VK_NULL_HANDLE;
        checkXr(xrFunction<PFN_xrGetVulkanGraphicsDevice2KHR>(instance, "xrGetVulkanGraphicsDevice2KHR")(instance, &get,
                                                                                                         &physical),
                "xrGetVulkanGraphicsDevice2KHR");
        return physical;
    };
    maker.device = [this](VkPhysicalDevice physical, const VkDeviceCreateInfo& info, VkDevice* made) {
        auto create = xrInfo<XrVulkanDeviceCreateInfoKHR>(XR_TYPE_VULKAN_DEVICE_CREATE_INFO_KHR);
        create.systemId = system;
        create.pfnGetInstanceProcAddr = vkGetInstanceProcAddr;
        create.vulkanPhysicalDevice = physical;
        create.vulkanCreateInfo = &info;
        VkResult result = VK_SUCCESS;
        checkXr(xrFunction<PFN_xrCreateVulkanDeviceKHR>(instance, "xrCreateVulkanDeviceKHR")(instance, &create, made,
                                                                                             &result),
                "xrCreateVulkanDeviceKHR");
        return result;
    };
    device = std::make_unique<VulkanDevice>(options);
    device->open(VK_NULL_HANDLE);
    facts.gpu = device->name;
    facts.draws = device->shares;
}

} // namespace gsc
