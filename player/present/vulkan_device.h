// SPDX-License-Identifier: Apache-2.0
// A Vulkan instance and device with one queue.
#pragma once

#include "player/present/presenter.h"

#include <vulkan/vulkan.h>

#include <functional>

namespace gsc {

// Throws Error for a result that is no success: OutOfMemory, or Device with `what` failed.
void checkVulkan(VkResult result, const char* what);

// A structure of Vulkan with its type field set.
template <typename Info>
Info vulkanInfo(VkStructureType type, const void* next = nullptr)
{
    Info info{};
    info.sType = type;
    info.pNext = const_cast<void*>(next);
    return info;
}

// Who makes Vulkan's objects, where that is not the program: an OpenXR runtime does so itself.
struct VulkanMaker {
    std::function<VkResult(const VkInstanceCreateInfo&, VkInstance*)> instance;
    std::function<VkPhysicalDevice(VkInstance)> physical; // throws Error
    std::function<VkResult(VkPhysicalDevice, const VkDeviceCreateInfo&, VkDevice*)> device;
};

struct VulkanDeviceOptions {
    std::vector<const char*> instance_extensions; // extensions that a surface needs
    std::optional<DeviceUuid> uuid;               // only this device will do; none = the best device
    bool presents = false;                        // must be able to present to a surface
    uint32_t version = VK_API_VERSION_1_2;        // least version
    std::optional<VulkanMaker> maker;             // none = the program; one has a single queue, which draws
};

class VulkanDevice {
public:
    // Throws Error(Unsupported) where there is no Vulkan 1.2 device.
    explicit VulkanDevice(const VulkanDeviceOptions& options);
    ~VulkanDevice();
    VulkanDevice(const VulkanDevice&) = delete;
    VulkanDevice& operator=(const VulkanDevice&) = delete;

    // Makes the device, of a physical one that can present to `surface`. Without one every queue family that can copy to
    // images has a queue, and useFamily() takes one of `families`.
    void open(VkSurfaceKHR surface);
    void useFamily(uint32_t index);

    [[nodiscard]] uint32_t memoryType(uint32_t bits, VkMemoryPropertyFlags wanted) const; // throws Error(Unsupported)

    VkInstance instance = VK_NULL_HANDLE;
    VkPhysicalDevice physical = VK_NULL_HANDLE;
    VkDevice handle = VK_NULL_HANDLE;
    VkQueue queue = VK_NULL_HANDLE;
    uint32_t family = 0;
    std::vector<uint32_t> families;
    VkPipelineStageFlags stages = 0; // stages at which its queue writes images
    std::string name;
    bool shares = false; // has the UUID asked for, and exports memory and semaphores
    double tick_ns = 0;  // nanoseconds of a tick of timestamps; 0 = it has none
    VkPhysicalDeviceMemoryProperties memory{};

private:
    void choose(VkSurfaceKHR surface);

    VulkanDeviceOptions m_options;
};

// A buffer or an image with memory of its own. Its device outlives it.
struct VulkanBuffer {
    VulkanBuffer() = default;
    // `exported`: its memory can be opened by others.
    VulkanBuffer(const VulkanDevice& device, size_t bytes, VkBufferUsageFlags usage, VkMemoryPropertyFlags properties,
                 bool exported = false);
    ~VulkanBuffer();
    VulkanBuffer(VulkanBuffer&& other) noexcept { *this = std::move(other); }
    VulkanBuffer& operator=(VulkanBuffer&& other) noexcept;

    VkDevice device = VK_NULL_HANDLE;
    VkBuffer handle = VK_NULL_HANDLE;
    VkDeviceMemory memory = VK_NULL_HANDLE;
    size_t bytes = 0, allocated = 0;
    std::byte* mapped = nullptr; // address for the host
};

struct VulkanImage {
    VulkanImage() = default;
    VulkanImage(const VulkanDevice& device, uint32_t width, uint32_t height, VkFormat format, VkImageUsageFlags usage);
    ~VulkanImage();
    VulkanImage(VulkanImage&& other) noexcept { *this = std::move(other); }
    VulkanImage& operator=(VulkanImage&& other) noexcept;

    VkDevice device = VK_NULL_HANDLE;
    VkImage handle = VK_NULL_HANDLE;
    VkDeviceMemory memory = VK_NULL_HANDLE;
    uint32_t width = 0, height = 0;
};

} // namespace gsc
