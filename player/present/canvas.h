// SPDX-License-Identifier: Apache-2.0
// The image that the pictures of a frame are copied to, with the resources of one frame in flight.
#pragma once

#include "player/present/picture_copy.h"

namespace gsc {

class Canvas : public PictureCopy {
public:
    Canvas(const VulkanDevice& device, VkCommandPool pool, VkFormat format);
    ~Canvas();

    // Begins to record: pictures to the image, which is left to be copied from. `block`: the buffer of a shared one.
    void draw(const FrameToShow& frame, const std::function<VkBuffer(uint32_t id)>& block);
    // Adds: the whole of `image`, which can be copied from, to memory that the host reads.
    void readBack(VkImage image, uint32_t width, uint32_t height);

    VkSemaphore acquired = VK_NULL_HANDLE;
    VulkanImage image;
    VulkanBuffer read; // pixels that readBack() copied
    uint32_t read_width = 0, read_height = 0;

private:
    const VulkanDevice& m_device;
    VkFormat m_format;
};

// The queue family that copies from a buffer to an image in the least time, tried with a picture of 2048 x 1024: those of a
// GPU for computing differ by five times, and the one that draws is not the fastest. Throws Error.
uint32_t fastestCopyFamily(VulkanDevice& device, VkFormat format);

} // namespace gsc
