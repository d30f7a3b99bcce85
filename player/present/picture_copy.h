// SPDX-License-Identifier: Apache-2.0
// Copies pictures to images of Vulkan, with the resources of one frame in flight.
#pragma once

#include "player/present/vulkan_device.h"

#include <functional>

namespace gsc {

class PictureCopy {
public:
    PictureCopy(const VulkanDevice& device, VkCommandPool pool);
    ~PictureCopy();
    PictureCopy(const PictureCopy&) = delete;
    PictureCopy& operator=(const PictureCopy&) = delete;

    // Until the GPU is done with the frame before. Throws Error(Device) where it is not after ten seconds.
    void wait();

    void reserve(size_t bytes); // for pictures in memory of this process: later frames then allocate nothing
    // Begins to record: brings those in memory of this process to where the GPU reads.
    void begin(std::span<const ShownPicture> pictures);
    // Once for each of begin()'s, in their order: to `image` in layout TRANSFER_DST_OPTIMAL, at x, y. `block`: the buffer of
    // a shared one.
    void copy(const ShownPicture& picture, VkImage image, uint32_t x, uint32_t y,
              const std::function<VkBuffer(uint32_t id)>& block);
    void endCopies(); // ends the time that is measured
    void end();
    void submit(const VkSubmitInfo& info); // submits the recorded commands with `info`

    VkCommandBuffer commands = VK_NULL_HANDLE;
    VkFence done = VK_NULL_HANDLE;
    uint64_t shared_value = 0; // value of the semaphore that pictures wait for, 0 = none

    // Milliseconds from begin() to endCopies() in the last frame that is done, 0 = unknown.
    [[nodiscard]] double copyMs() const { return m_copy_ms; }
    [[nodiscard]] bool busy() const { return vkGetFenceStatus(m_device.handle, done) == VK_NOT_READY; }

private:
    void makeFence();

    const VulkanDevice& m_device;
    VkCommandPool m_pool;
    VulkanBuffer m_staging; // buffer for pictures in memory of this process
    size_t m_staged = 0;    // bytes of the buffer that are copied to images so far
    VkQueryPool m_clock = VK_NULL_HANDLE;
    bool m_timed = false;
    double m_copy_ms = 0;
};

// Moves an image from one layout to another, all writes before it seen by all reads after it. `stages`: VulkanDevice's.
void changeLayout(VkCommandBuffer commands, VkPipelineStageFlags stages, VkImage image, VkImageLayout from,
                  VkImageLayout to, VkImageAspectFlags aspect = VK_IMAGE_ASPECT_COLOR_BIT);

} // namespace gsc
