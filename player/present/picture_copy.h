// SPDX-License-Identifier: Apache-2.0
// Copies pictures to Vulkan images, with the resources of one frame in flight.
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

    // Waits until the GPU has finished the last frame that was submitted here. Throws Error(Device) after ten seconds.
    void wait();

    void reserve(size_t bytes); // allocates for pictures in memory of this process, so that no frame has to
    // Begins a command buffer, and copies pictures that lie in memory of this process to a buffer that the GPU reads.
    void begin(std::span<const ShownPicture> pictures);
    // Records the copy of a picture to `image`, which is in layout TRANSFER_DST_OPTIMAL, at pixel x, y. Call it once
    // for each picture of begin(), in order. `block` is the buffer of the picture's shared block.
    void copy(const ShownPicture& picture, VkImage image, uint32_t x, uint32_t y,
              const std::function<VkBuffer(uint32_t id)>& block);
    void endCopies(); // marks the end of the time that copyMs() measures
    void end();
    void submit(const VkSubmitInfo& info); // submits the recorded commands with `info`

    VkCommandBuffer commands = VK_NULL_HANDLE;
    VkFence done = VK_NULL_HANDLE;
    uint64_t shared_value = 0; // value of the shared semaphore that the pictures wait for; 0 = none

    // Milliseconds from begin() to endCopies() on the GPU, in the last frame that has finished; 0 = unknown.
    [[nodiscard]] double copyMs() const { return m_copy_ms; }
    [[nodiscard]] bool busy() const { return vkGetFenceStatus(m_device.handle, done) == VK_NOT_READY; }

private:
    void makeFence();

    const VulkanDevice& m_device;
    VkCommandPool m_pool;
    VulkanBuffer m_staging; // buffer for pictures that lie in memory of this process
    size_t m_staged = 0;    // bytes of m_staging whose copies to images are recorded
    VkQueryPool m_clock = VK_NULL_HANDLE;
    bool m_timed = false;
    double m_copy_ms = 0;
};

// Changes the layout of an image; reads after this see all writes before it. `stages` are VulkanDevice::stages.
void changeLayout(VkCommandBuffer commands, VkPipelineStageFlags stages, VkImage image, VkImageLayout from,
                  VkImageLayout to, VkImageAspectFlags aspect = VK_IMAGE_ASPECT_COLOR_BIT);

} // namespace gsc
