// SPDX-License-Identifier: Apache-2.0
#include "functions.h"
#include "runtime.h"

namespace gsc::fake_xr {

namespace {

template <typename Function>
Function load(const Runtime& rt, VkInstance instance, const char* name)
{
    const auto found = reinterpret_cast<Function>(rt.vulkan.loader(instance, name));
    if (found == nullptr)
        refuse(XR_ERROR_RUNTIME_FAILURE, std::string("the application's Vulkan lacks ") + name);
    return found;
}

void requireVulkanInstance(const Runtime& rt, VkInstance instance)
{
    if (instance == VK_NULL_HANDLE || instance != rt.vulkan.instance)
        refuse(XR_ERROR_VALIDATION_FAILURE, "vulkanInstance was not made by xrCreateVulkanInstanceKHR");
}

} // namespace

XrResult xrGetVulkanGraphicsRequirements2KHR(XrInstance instance, XrSystemId system,
                                             XrGraphicsRequirementsVulkanKHR* out)
{
    return guarded("xrGetVulkanGraphicsRequirements2KHR", [&](Runtime& rt) {
        rt.requireSystem(instance, system);
        requireType(out, XR_TYPE_GRAPHICS_REQUIREMENTS_VULKAN2_KHR, "graphicsRequirements");
        out->minApiVersionSupported = rt.settings.vulkan_min;
        out->maxApiVersionSupported = XR_MAKE_VERSION(1, 3, 0);
        rt.vulkan.requirements_asked = true;
        return XR_SUCCESS;
    });
}

XrResult xrCreateVulkanInstanceKHR(XrInstance instance, const XrVulkanInstanceCreateInfoKHR* info, VkInstance* out,
                                   VkResult* result)
{
    return guarded("xrCreateVulkanInstanceKHR", [&](Runtime& rt) {
        requireType(info, XR_TYPE_VULKAN_INSTANCE_CREATE_INFO_KHR, "createInfo");
        rt.requireSystem(instance, info->systemId);
        requirePointer(out, "vulkanInstance");
        requirePointer(result, "vulkanResult");
        requirePointer(info->pfnGetInstanceProcAddr, "pfnGetInstanceProcAddr");
        requirePointer(info->vulkanCreateInfo, "vulkanCreateInfo");
        if (info->createFlags != 0)
            refuse(XR_ERROR_VALIDATION_FAILURE, "createFlags is not 0");
        const VkApplicationInfo* application = info->vulkanCreateInfo->pApplicationInfo;
        const uint32_t asked =
            application != nullptr && application->apiVersion != 0 ? application->apiVersion : VK_API_VERSION_1_0;
        const XrVersion version = XR_MAKE_VERSION(VK_API_VERSION_MAJOR(asked), VK_API_VERSION_MINOR(asked), 0);
        if (version < rt.settings.vulkan_min)
            refuse(XR_ERROR_VALIDATION_FAILURE, formatString("Vulkan %u.%u is less than the graphics requirements",
                                                             VK_API_VERSION_MAJOR(asked), VK_API_VERSION_MINOR(asked)));
        rt.vulkan.loader = info->pfnGetInstanceProcAddr;
        const auto create = load<PFN_vkCreateInstance>(rt, VK_NULL_HANDLE, "vkCreateInstance");
        *result = create(info->vulkanCreateInfo, info->vulkanAllocator, out);
        rt.vulkan.instance = *result == VK_SUCCESS ? *out : VK_NULL_HANDLE;
        return XR_SUCCESS; // Vulkan's own refusal is the second result
    });
}

XrResult xrGetVulkanGraphicsDevice2KHR(XrInstance instance, const XrVulkanGraphicsDeviceGetInfoKHR* info,
                                       VkPhysicalDevice* out)
{
    return guarded("xrGetVulkanGraphicsDevice2KHR", [&](Runtime& rt) {
        requireType(info, XR_TYPE_VULKAN_GRAPHICS_DEVICE_GET_INFO_KHR, "getInfo");
        rt.requireSystem(instance, info->systemId);
        requirePointer(out, "vulkanPhysicalDevice");
        requireVulkanInstance(rt, info->vulkanInstance);
        const auto list = load<PFN_vkEnumeratePhysicalDevices>(rt, rt.vulkan.instance, "vkEnumeratePhysicalDevices");
        uint32_t count = 0;
        list(rt.vulkan.instance, &count, nullptr);
        std::vector<VkPhysicalDevice> devices(count);
        list(rt.vulkan.instance, &count, devices.data());
        if (rt.settings.gpu >= count)
            refuse(XR_ERROR_RUNTIME_FAILURE, formatString("no GPU %u among %u", rt.settings.gpu, count));
        *out = rt.vulkan.physical = devices[rt.settings.gpu];
        return XR_SUCCESS;
    });
}

XrResult xrCreateVulkanDeviceKHR(XrInstance instance, const XrVulkanDeviceCreateInfoKHR* info, VkDevice* out,
                                 VkResult* result)
{
    return guarded("xrCreateVulkanDeviceKHR", [&](Runtime& rt) {
        requireType(info, XR_TYPE_VULKAN_DEVICE_CREATE_INFO_KHR, "createInfo");
        rt.requireSystem(instance, info->systemId);
        requirePointer(out, "vulkanDevice");
        requirePointer(result, "vulkanResult");
        requirePointer(info->vulkanCreateInfo, "vulkanCreateInfo");
        if (info->createFlags != 0)
            refuse(XR_ERROR_VALIDATION_FAILURE, "createFlags is not 0");
        if (info->vulkanPhysicalDevice == VK_NULL_HANDLE || info->vulkanPhysicalDevice != rt.vulkan.physical)
            refuse(XR_ERROR_HANDLE_INVALID, "vulkanPhysicalDevice is not that of xrGetVulkanGraphicsDevice2KHR");
        const auto create = load<PFN_vkCreateDevice>(rt, rt.vulkan.instance, "vkCreateDevice");
        *result = create(info->vulkanPhysicalDevice, info->vulkanCreateInfo, info->vulkanAllocator, out);
        rt.vulkan.device = *result == VK_SUCCESS ? *out : VK_NULL_HANDLE;
        rt.vulkan.queues.clear();
        for (uint32_t i = 0; i < info->vulkanCreateInfo->queueCreateInfoCount; ++i) {
            const VkDeviceQueueCreateInfo& queue = info->vulkanCreateInfo->pQueueCreateInfos[i];
            rt.vulkan.queues[queue.queueFamilyIndex] = queue.queueCount;
        }
        return XR_SUCCESS;
    });
}

} // namespace gsc::fake_xr
