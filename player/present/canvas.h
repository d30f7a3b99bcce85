// SPDX-License-Identifier: Apache-2.0
// The image that the pictures of a frame are copied to, and the Vulkan resources of one frame in flight.
#pragma once

#include "player/present/picture_copy.h"

namespace gsc {

class Canvas : public PictureCopy {
public:
    Canvas(const VulkanDevice& device, VkCommandPool pool, VkFormat format);
    ~Canvas();

    // Begins the command buffer: copies the pictures to the image, which can be copied from afterwards. `block`
    // returns the buffer of a shared block.
    void draw(const FrameToShow& frame, const std::function<VkBuffer(uint32_t id)>& block);
    // Adds a copy of the whole of `image` to memory that the host reads. The image must be in a layout that can be
    // copied from.
    void readBack(VkImage image, uint32_t width, uint32_t height);

    VkSemaphore acquired = VK_NULL_HANDLE;
    VulkanImage image;
    VulkanBuffer read; // pixels that readBack() copied, for the host
    uint32_t read_width = 0, read_height = 0;

private:
    const VulkanDevice& m_device;
    VkFormat m_format;
};

// Finds the queue family that copies from a buffer to an image in the least time, by trying each with a picture of
// 2048 x 1024. Families for computing differ by up to five times on one GPU, and the one that draws is not the
// fastest. Throws Error.
uint32_t fastestCopyFamily(VulkanDevice& device, VkFormat format);

} // namespace gsc
