// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "openxr_headers.h"

#include <cstddef>
#include <optional>
#include <vector>

// clang-format off
#define GSC_FAKE_XR_VULKAN(X) \
    X(vkGetPhysicalDeviceMemoryProperties) X(vkGetPhysicalDeviceImageFormatProperties) X(vkGetDeviceQueue) \
    X(vkDeviceWaitIdle) X(vkCreateImage) X(vkDestroyImage) X(vkGetImageMemoryRequirements) X(vkBindImageMemory) \
    X(vkCreateBuffer) X(vkDestroyBuffer) X(vkGetBufferMemoryRequirements) X(vkBindBufferMemory) X(vkAllocateMemory) \
    X(vkFreeMemory) X(vkMapMemory) X(vkCreateCommandPool) X(vkDestroyCommandPool) X(vkAllocateCommandBuffers) \
    X(vkCreateFence) X(vkDestroyFence) X(vkWaitForFences) X(vkResetFences) X(vkBeginCommandBuffer) \
    X(vkEndCommandBuffer) X(vkCmdPipelineBarrier) X(vkCmdCopyImageToBuffer) X(vkQueueSubmit)
// clang-format on

namespace gsc::fake_xr {

struct GpuImage {
    VkImage image = VK_NULL_HANDLE;
    VkDeviceMemory memory = VK_NULL_HANDLE;
    bool laid_out = false; // in the layout that the application expects
};

struct PixelFormat {
    VkFormat format;
    uint32_t bytes;
    bool depth, bgra, rgb8; // rgb8: a PPM can show it
};

// The formats that settings may offer.
std::optional<PixelFormat> pixelFormat(int64_t format);

// The session's device and queue, which belong to the application. Not thread-safe, as the queue is not. Throws
// std::runtime_error when Vulkan fails.
class Gpu {
public:
    Gpu(PFN_vkGetInstanceProcAddr loader, const XrGraphicsBindingVulkan2KHR& binding);
    ~Gpu();
    Gpu(const Gpu&) = delete;
    Gpu& operator=(const Gpu&) = delete;

    [[nodiscard]] bool supports(const XrSwapchainCreateInfo& info) const;
    [[nodiscard]] GpuImage createImage(const XrSwapchainCreateInfo& info);
    void destroyImages(std::vector<GpuImage>& images); // waits for the device
    // Gives an image the layout in which XR_KHR_vulkan_enable2 hands images out: that of an attachment.
    void layOut(GpuImage& image, const XrSwapchainCreateInfo& info);
    // Pixels of a released image, rows without gaps; valid until the next call.
    const std::byte* read(const GpuImage& image, const PixelFormat& format, uint32_t layer, const XrRect2Di& rect);

private:
    void check(VkResult result, const char* what) const;
    [[nodiscard]] uint32_t memoryType(uint32_t bits, VkMemoryPropertyFlags wanted,
                                      VkMemoryPropertyFlags better = 0) const;
    void growBuffer(VkDeviceSize bytes);
    void begin();
    void submitAndWait();

#define GSC_FAKE_XR_MEMBER(name) PFN_##name name = nullptr;
    GSC_FAKE_XR_VULKAN(GSC_FAKE_XR_MEMBER)
#undef GSC_FAKE_XR_MEMBER
    VkPhysicalDevice m_physical;
    VkDevice m_device;
    VkQueue m_queue = VK_NULL_HANDLE;
    VkCommandPool m_pool = VK_NULL_HANDLE;
    VkCommandBuffer m_commands = VK_NULL_HANDLE;
    VkFence m_fence = VK_NULL_HANDLE;
    VkBuffer m_buffer = VK_NULL_HANDLE;
    VkDeviceMemory m_buffer_memory = VK_NULL_HANDLE;
    VkDeviceSize m_buffer_bytes = 0;
    void* m_mapped = nullptr;
};

} // namespace gsc::fake_xr
