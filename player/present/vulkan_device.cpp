// SPDX-License-Identifier: Apache-2.0
#include "player/present/vulkan_device.h"

#include <gsc/error.h>

#include <algorithm>
#include <cstring>
#include <utility>

namespace gsc {

namespace {

template <typename Item, typename List>
std::vector<Item> listOf(const List& list)
{
    uint32_t count = 0;
    list(&count, nullptr);
    std::vector<Item> items(count);
    list(&count, items.data());
    items.resize(count);
    return items;
}

bool hasExtension(VkPhysicalDevice physical, const char* name)
{
    const auto there = listOf<VkExtensionProperties>([&](uint32_t* count, VkExtensionProperties* items) {
        vkEnumerateDeviceExtensionProperties(physical, nullptr, count, items);
    });
    return std::ranges::any_of(there, [&](const auto& e) { return std::strcmp(e.extensionName, name) == 0; });
}

constexpr const char* kShareExtensions[] = {VK_KHR_EXTERNAL_MEMORY_FD_EXTENSION_NAME,
                                            VK_KHR_EXTERNAL_SEMAPHORE_FD_EXTENSION_NAME};

bool canShare(VkPhysicalDevice physical)
{
    return std::ranges::all_of(kShareExtensions, [&](const char* name) { return hasExtension(physical, name); });
}

std::optional<uint32_t> familyOf(VkPhysicalDevice physical, VkSurfaceKHR surface)
{
    const auto families = listOf<VkQueueFamilyProperties>([&](uint32_t* count, VkQueueFamilyProperties* items) {
        vkGetPhysicalDeviceQueueFamilyProperties(physical, count, items);
    });
    for (uint32_t i = 0; i < families.size(); ++i) {
        VkBool32 presents = VK_TRUE;
        if (surface != VK_NULL_HANDLE &&
            vkGetPhysicalDeviceSurfaceSupportKHR(physical, i, surface, &presents) != VK_SUCCESS)
            presents = VK_FALSE;
        if ((families[i].queueFlags & VK_QUEUE_GRAPHICS_BIT) != 0 && presents)
            return i;
    }
    return std::nullopt;
}

// Finds the queue families that can copy to any place of an image and measure the time of a copy.
std::vector<uint32_t> copyFamilies(VkPhysicalDevice physical)
{
    constexpr VkQueueFlags kCopies = VK_QUEUE_GRAPHICS_BIT | VK_QUEUE_COMPUTE_BIT | VK_QUEUE_TRANSFER_BIT;
    const auto families = listOf<VkQueueFamilyProperties>([&](uint32_t* count, VkQueueFamilyProperties* items) {
        vkGetPhysicalDeviceQueueFamilyProperties(physical, count, items);
    });
    std::vector<uint32_t> found;
    for (uint32_t i = 0; i < families.size(); ++i) {
        const VkExtent3D& step = families[i].minImageTransferGranularity;
        if ((families[i].queueFlags & kCopies) != 0 && families[i].timestampValidBits > 0 && step.width == 1 &&
            step.height == 1)
            found.push_back(i);
    }
    return found;
}

int kindRank(VkPhysicalDeviceType type)
{
    return type == VK_PHYSICAL_DEVICE_TYPE_DISCRETE_GPU ? 3 : type == VK_PHYSICAL_DEVICE_TYPE_INTEGRATED_GPU ? 2 : 1;
}

} // namespace

void checkVulkan(VkResult result, const char* what)
{
    if (result == VK_SUCCESS || result == VK_SUBOPTIMAL_KHR)
        return;
    const bool full = result == VK_ERROR_OUT_OF_HOST_MEMORY || result == VK_ERROR_OUT_OF_DEVICE_MEMORY;
    const bool lost = result == VK_ERROR_DEVICE_LOST || result == VK_ERROR_SURFACE_LOST_KHR;
    throw Error(full ? ErrorCode::OutOfMemory : ErrorCode::Device, "display",
                formatString("%s failed with Vulkan's code %d%s", what, int(result), lost ? " (lost)" : ""), "success",
                full ? "make the pictures smaller" : "start again, or play without a display if it stays so");
}

VulkanDevice::VulkanDevice(const VulkanDeviceOptions& options) : m_options(options)
{
    auto application = vulkanInfo<VkApplicationInfo>(VK_STRUCTURE_TYPE_APPLICATION_INFO);
    application.pApplicationName = "gsc-play";
    application.apiVersion = m_options.version;
    auto info = vulkanInfo<VkInstanceCreateInfo>(VK_STRUCTURE_TYPE_INSTANCE_CREATE_INFO);
    info.pApplicationInfo = &application;
    info.enabledExtensionCount = uint32_t(m_options.instance_extensions.size());
    info.ppEnabledExtensionNames = m_options.instance_extensions.data();
    const VkResult result =
        m_options.maker ? m_options.maker->instance(info, &instance) : vkCreateInstance(&info, nullptr, &instance);
    if (result != VK_SUCCESS)
        throw Error(ErrorCode::Unsupported, "display", formatString("no Vulkan driver (code %d)", int(result)),
                    "one of Vulkan 1.2", "install one, such as mesa-vulkan-drivers, or play without a display");
}

VulkanDevice::~VulkanDevice()
{
    if (handle != VK_NULL_HANDLE)
        vkDestroyDevice(handle, nullptr);
    if (instance != VK_NULL_HANDLE)
        vkDestroyInstance(instance, nullptr);
}

// Chooses the GPU that draws, if it may be used, else the fastest kind of GPU.
void VulkanDevice::choose(VkSurfaceKHR surface)
{
    auto all = listOf<VkPhysicalDevice>(
        [&](uint32_t* count, VkPhysicalDevice* items) { vkEnumeratePhysicalDevices(instance, count, items); });
    if (m_options.maker)
        all = {m_options.maker->physical(instance)};
    int best = -1;
    for (const VkPhysicalDevice candidate : all) {
        auto id = vulkanInfo<VkPhysicalDeviceIDProperties>(VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_ID_PROPERTIES);
        auto properties = vulkanInfo<VkPhysicalDeviceProperties2>(VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PROPERTIES_2, &id);
        vkGetPhysicalDeviceProperties2(candidate, &properties);
        const VkPhysicalDeviceProperties& p = properties.properties;
        const std::optional<uint32_t> usable = familyOf(candidate, surface);
        if (!usable || p.apiVersion < VK_API_VERSION_1_2 ||
            (m_options.presents && !hasExtension(candidate, VK_KHR_SWAPCHAIN_EXTENSION_NAME)))
            continue;
        const bool draws = m_options.uuid && std::equal(m_options.uuid->begin(), m_options.uuid->end(), id.deviceUUID);
        const int rank = kindRank(p.deviceType) + (draws ? 10 : 0);
        if (rank <= best)
            continue;
        best = rank;
        physical = candidate;
        family = *usable;
        name = p.deviceName;
        shares = draws && canShare(candidate);
        tick_ns = p.limits.timestampComputeAndGraphics ? double(p.limits.timestampPeriod) : 0;
    }
    if (best < 0)
        throw Error(ErrorCode::Unsupported, "display",
                    formatString("none of %zu Vulkan devices shows pictures%s", all.size(),
                                 m_options.presents ? " in a window" : ""),
                    "one of Vulkan 1.2", "update the driver, or play without a display");
}

void VulkanDevice::open(VkSurfaceKHR surface)
{
    choose(surface);
    vkGetPhysicalDeviceMemoryProperties(physical, &memory);
    std::vector<const char*> extensions;
    if (m_options.presents)
        extensions.push_back(VK_KHR_SWAPCHAIN_EXTENSION_NAME);
    if (shares)
        extensions.insert(extensions.end(), std::begin(kShareExtensions), std::end(kShareExtensions));
    const bool one_queue = surface != VK_NULL_HANDLE || m_options.maker;
    families = one_queue ? std::vector<uint32_t>{family} : copyFamilies(physical);
    if (std::ranges::find(families, family) == families.end())
        families.push_back(family);
    const float priority = 1;
    std::vector<VkDeviceQueueCreateInfo> queues;
    for (const uint32_t index : families) {
        auto& each =
            queues.emplace_back(vulkanInfo<VkDeviceQueueCreateInfo>(VK_STRUCTURE_TYPE_DEVICE_QUEUE_CREATE_INFO));
        each.queueFamilyIndex = index;
        each.queueCount = 1;
        each.pQueuePriorities = &priority;
    }
    // not VkPhysicalDeviceVulkan12Features: an OpenXR runtime may add one of the structures that it contains, and both
    // together are not allowed
    auto timeline = vulkanInfo<VkPhysicalDeviceTimelineSemaphoreFeatures>(
        VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_TIMELINE_SEMAPHORE_FEATURES);
    auto features = vulkanInfo<VkPhysicalDeviceHostQueryResetFeatures>(
        VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_HOST_QUERY_RESET_FEATURES, &timeline);
    timeline.timelineSemaphore = features.hostQueryReset = VK_TRUE;
    auto info = vulkanInfo<VkDeviceCreateInfo>(VK_STRUCTURE_TYPE_DEVICE_CREATE_INFO, &features);
    info.queueCreateInfoCount = uint32_t(queues.size());
    info.pQueueCreateInfos = queues.data();
    info.enabledExtensionCount = uint32_t(extensions.size());
    info.ppEnabledExtensionNames = extensions.data();
    checkVulkan(m_options.maker ? m_options.maker->device(physical, info, &handle)
                                : vkCreateDevice(physical, &info, nullptr, &handle),
                "vkCreateDevice");
    useFamily(family);
}

void VulkanDevice::useFamily(uint32_t index)
{
    const auto all = listOf<VkQueueFamilyProperties>([&](uint32_t* count, VkQueueFamilyProperties* items) {
        vkGetPhysicalDeviceQueueFamilyProperties(physical, count, items);
    });
    family = index;
    stages = VK_PIPELINE_STAGE_TRANSFER_BIT;
    if ((all[index].queueFlags & VK_QUEUE_GRAPHICS_BIT) != 0)
        stages |= VK_PIPELINE_STAGE_COLOR_ATTACHMENT_OUTPUT_BIT;
    vkGetDeviceQueue(handle, family, 0, &queue);
}

uint32_t VulkanDevice::memoryType(uint32_t bits, VkMemoryPropertyFlags wanted) const
{
    for (uint32_t i = 0; i < memory.memoryTypeCount; ++i)
        if ((bits >> i & 1) != 0 && (memory.memoryTypes[i].propertyFlags & wanted) == wanted)
            return i;
    throw Error(ErrorCode::Unsupported, "display", formatString("%s has no memory of kind %u", name.c_str(), wanted),
                "some", "update its driver, or play without a display");
}

VulkanBuffer::VulkanBuffer(const VulkanDevice& d, size_t size, VkBufferUsageFlags usage,
                           VkMemoryPropertyFlags properties, bool exported)
    : device(d.handle), bytes(size)
{
    constexpr VkExternalMemoryHandleTypeFlagBits kFile = VK_EXTERNAL_MEMORY_HANDLE_TYPE_OPAQUE_FD_BIT;
    auto external = vulkanInfo<VkExternalMemoryBufferCreateInfo>(VK_STRUCTURE_TYPE_EXTERNAL_MEMORY_BUFFER_CREATE_INFO);
    external.handleTypes = kFile;
    auto info = vulkanInfo<VkBufferCreateInfo>(VK_STRUCTURE_TYPE_BUFFER_CREATE_INFO, exported ? &external : nullptr);
    info.size = size;
    info.usage = usage;
    checkVulkan(vkCreateBuffer(device, &info, nullptr, &handle), "vkCreateBuffer");
    VkMemoryRequirements needs{};
    vkGetBufferMemoryRequirements(device, handle, &needs);
    auto export_info = vulkanInfo<VkExportMemoryAllocateInfo>(VK_STRUCTURE_TYPE_EXPORT_MEMORY_ALLOCATE_INFO);
    export_info.handleTypes = kFile;
    auto allocate =
        vulkanInfo<VkMemoryAllocateInfo>(VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO, exported ? &export_info : nullptr);
    allocate.allocationSize = allocated = needs.size;
    try {
        allocate.memoryTypeIndex = d.memoryType(needs.memoryTypeBits, properties);
        checkVulkan(vkAllocateMemory(device, &allocate, nullptr, &memory), "vkAllocateMemory");
        checkVulkan(vkBindBufferMemory(device, handle, memory, 0), "vkBindBufferMemory");
        if ((properties & VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT) != 0) {
            void* at = nullptr;
            checkVulkan(vkMapMemory(device, memory, 0, VK_WHOLE_SIZE, 0, &at), "vkMapMemory");
            mapped = static_cast<std::byte*>(at);
        }
    } catch (...) { // a destructor does not run if the constructor throws
        vkDestroyBuffer(device, handle, nullptr);
        vkFreeMemory(device, memory, nullptr);
        throw;
    }
}

VulkanBuffer::~VulkanBuffer()
{
    if (device == VK_NULL_HANDLE)
        return;
    vkDestroyBuffer(device, handle, nullptr);
    vkFreeMemory(device, memory, nullptr);
}

VulkanBuffer& VulkanBuffer::operator=(VulkanBuffer&& other) noexcept
{
    std::swap(device, other.device);
    std::swap(handle, other.handle);
    std::swap(memory, other.memory);
    std::swap(bytes, other.bytes);
    std::swap(allocated, other.allocated);
    std::swap(mapped, other.mapped);
    return *this;
}

VulkanImage::VulkanImage(const VulkanDevice& d, uint32_t w, uint32_t h, VkFormat format, VkImageUsageFlags usage)
    : device(d.handle), width(w), height(h)
{
    auto info = vulkanInfo<VkImageCreateInfo>(VK_STRUCTURE_TYPE_IMAGE_CREATE_INFO);
    info.imageType = VK_IMAGE_TYPE_2D;
    info.format = format;
    info.extent = {w, h, 1};
    info.mipLevels = info.arrayLayers = 1;
    info.samples = VK_SAMPLE_COUNT_1_BIT;
    info.usage = usage;
    checkVulkan(vkCreateImage(device, &info, nullptr, &handle), "vkCreateImage");
    VkMemoryRequirements needs{};
    vkGetImageMemoryRequirements(device, handle, &needs);
    auto allocate = vulkanInfo<VkMemoryAllocateInfo>(VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO);
    allocate.allocationSize = needs.size;
    try {
        allocate.memoryTypeIndex = d.memoryType(needs.memoryTypeBits, VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT);
        checkVulkan(vkAllocateMemory(device, &allocate, nullptr, &memory), "vkAllocateMemory");
        checkVulkan(vkBindImageMemory(device, handle, memory, 0), "vkBindImageMemory");
    } catch (...) {
        vkDestroyImage(device, handle, nullptr);
        vkFreeMemory(device, memory, nullptr);
        throw;
    }
}

VulkanImage::~VulkanImage()
{
    if (device == VK_NULL_HANDLE)
        return;
    vkDestroyImage(device, handle, nullptr);
    vkFreeMemory(device, memory, nullptr);
}

VulkanImage& VulkanImage::operator=(VulkanImage&& other) noexcept
{
    std::swap(device, other.device);
    std::swap(handle, other.handle);
    std::swap(memory, other.memory);
    std::swap(width, other.width);
    std::swap(height, other.height);
    return *this;
}

} // namespace gsc
