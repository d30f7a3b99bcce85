// SPDX-License-Identifier: Apache-2.0
// The image that the pictures of a frame are copied to, with what one frame in flight needs.
#pragma once

#include "player/present/vulkan_device.h"

#include <functional>

namespace gsc {

class Canvas {
public:
    Canvas(const VulkanDevice& device, VkCommandPool pool, VkFormat format);
    ~Canvas();
    Canvas(const Canvas&) = delete;
    Canvas& operator=(const Canvas&) = delete;

    void wait(); // until the GPU is done with the frame before

    // Begins to record: pictures to the image, which is left to be copied from. `block`: the buffer of a shared one.
    void begin(const FrameToShow& frame, const std::function<VkBuffer(uint32_t id)>& block);
    // Adds: the whole of `image`, which can be copied from, to memory that the host reads.
    void readBack(VkImage image, uint32_t width, uint32_t height);
    void end();

    VkCommandBuffer commands = VK_NULL_HANDLE;
    VkFence done = VK_NULL_HANDLE;
    VkSemaphore acquired = VK_NULL_HANDLE;
    VulkanImage image;
    VulkanBuffer read; // what readBack() got
    uint32_t read_width = 0, read_height = 0;
    uint64_t shared_value = 0; // of the semaphore that pictures wait for, 0 = none

    // Milliseconds of the copy in the last frame that is done, 0 = unknown.
    [[nodiscard]] double copyMs() const { return m_copy_ms; }
    [[nodiscard]] bool busy() const { return vkGetFenceStatus(m_device.handle, done) == VK_NOT_READY; }

private:
    void stage(const FrameToShow& frame);

    const VulkanDevice& m_device;
    VkCommandPool m_pool;
    VkFormat m_format;
    VulkanBuffer m_staging; // of pictures in memory of this process
    VkQueryPool m_clock = VK_NULL_HANDLE;
    bool m_timed = false;
    double m_copy_ms = 0;
};

// Moves an image from one layout to another, all writes before it seen by all reads after it. `stages`: VulkanDevice's.
void changeLayout(VkCommandBuffer commands, VkPipelineStageFlags stages, VkImage image, VkImageLayout from,
                  VkImageLayout to);

// The queue family that copies from a buffer to an image in the least time, tried with a picture of 2048 x 1024: those of a
// GPU for computing differ by five times, and the one that draws is not the fastest. Throws Error.
uint32_t fastestCopyFamily(VulkanDevice& device, VkFormat format);

} // namespace gsc
