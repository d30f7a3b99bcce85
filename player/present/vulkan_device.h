// SPDX-License-Identifier: Apache-2.0
// A Vulkan instance and device with one queue.
#pragma once

#include "player/present/presenter.h"

#include <vulkan/vulkan.h>

#include <functional>

namespace gsc {

// Throws Error if a Vulkan result is no success: OutOfMemory, or Device, "`what` failed".
void checkVulkan(VkResult result, const char* what);

// Makes a Vulkan structure and sets the member `sType`.
template <typename Info>
Info vulkanInfo(VkStructureType type, const void* next = nullptr)
{
    Info info{};
    info.sType = type;
    info.pNext = const_cast<void*>(next);
    return info;
}

// Functions that make Vulkan's objects instead of this program: an OpenXR runtime makes them itself.
struct VulkanMaker {
    std::function<VkResult(const VkInstanceCreateInfo&, VkInstance*)> instance;
    std::function<VkPhysicalDevice(VkInstance)> physical; // chooses the physical device; throws Error
    std::function<VkResult(VkPhysicalDevice, const VkDeviceCreateInfo&, VkDevice*)> device;
};

struct VulkanDeviceOptions {
    std::vector<const char*> instance_extensions; // instance extensions that a surface needs
    std::optional<DeviceUuid> uuid;               // use only the device with this UUID; none = the best device
    bool presents = false;                        // the device must be able to present to a surface
    uint32_t version = VK_API_VERSION_1_2;        // lowest version of Vulkan
    // none = this program makes the objects; with a maker there is a single queue, which can draw
    std::optional<VulkanMaker> maker;
};

class VulkanDevice {
public:
    // Makes the instance and chooses the physical device. Throws Error(Unsupported) if there is no Vulkan 1.2 device.
    explicit VulkanDevice(const VulkanDeviceOptions& options);
    ~VulkanDevice();
    VulkanDevice(const VulkanDevice&) = delete;
    VulkanDevice& operator=(const VulkanDevice&) = delete;

    // Makes the logical device, on a physical one that can present to `surface`. Without a surface it gets a queue of
    // every family that can copy to images, and useFamily() chooses one of `families`.
    void open(VkSurfaceKHR surface);
    void useFamily(uint32_t index);

    // returns the index of a memory type; throws Error(Unsupported)
    [[nodiscard]] uint32_t memoryType(uint32_t bits, VkMemoryPropertyFlags wanted) const;

    VkInstance instance = VK_NULL_HANDLE;
    VkPhysicalDevice physical = VK_NULL_HANDLE;
    VkDevice handle = VK_NULL_HANDLE;
    VkQueue queue = VK_NULL_HANDLE;
    uint32_t family = 0;
    std::vector<uint32_t> families;
    VkPipelineStageFlags stages = 0; // pipeline stages at which the queue writes images
    std::string name;
    bool shares = false; // the device has the UUID asked for, and exports memory and semaphores
    double tick_ns = 0;  // nanoseconds in a tick of the device's timestamps; 0 = the device has none
    VkPhysicalDeviceMemoryProperties memory{};

private:
    void choose(VkSurfaceKHR surface);

    VulkanDeviceOptions m_options;
};

// A Vulkan buffer that owns its memory. The device must outlive the buffer.
struct VulkanBuffer {
    VulkanBuffer() = default;
    // `exported`: other program interfaces can open the memory.
    VulkanBuffer(const VulkanDevice& device, size_t bytes, VkBufferUsageFlags usage, VkMemoryPropertyFlags properties,
                 bool exported = false);
    ~VulkanBuffer();
    VulkanBuffer(VulkanBuffer&& other) noexcept { *this = std::move(other); }
    VulkanBuffer& operator=(VulkanBuffer&& other) noexcept;

    VkDevice device = VK_NULL_HANDLE;
    VkBuffer handle = VK_NULL_HANDLE;
    VkDeviceMemory memory = VK_NULL_HANDLE;
    size_t bytes = 0, allocated = 0;
    std::byte* mapped = nullptr; // address at which the host reads and writes the memory; null = not mapped
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
