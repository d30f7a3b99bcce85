// SPDX-License-Identifier: Apache-2.0
#include "player/present/canvas.h"

#include <gsc/error.h>

namespace gsc {

Canvas::Canvas(const VulkanDevice& device, VkCommandPool pool, VkFormat format)
    : PictureCopy(device, pool), m_device(device), m_format(format)
{
    const auto semaphore = vulkanInfo<VkSemaphoreCreateInfo>(VK_STRUCTURE_TYPE_SEMAPHORE_CREATE_INFO);
    checkVulkan(vkCreateSemaphore(device.handle, &semaphore, nullptr, &acquired), "vkCreateSemaphore");
}

Canvas::~Canvas()
{
    vkDestroySemaphore(m_device.handle, acquired, nullptr);
}

void Canvas::draw(const FrameToShow& frame, const std::function<VkBuffer(uint32_t id)>& block)
{
    if (image.width != frame.width || image.height != frame.height) {
        image = {};
        image = VulkanImage(m_device, frame.width, frame.height, m_format,
                            VK_IMAGE_USAGE_TRANSFER_SRC_BIT | VK_IMAGE_USAGE_TRANSFER_DST_BIT);
    }
    begin(frame.pictures);
    uint64_t covered = 0;
    for (const ShownPicture& picture : frame.pictures)
        covered += uint64_t(picture.width) * picture.height;
    changeLayout(commands, m_device.stages, image.handle, VK_IMAGE_LAYOUT_UNDEFINED,
                 VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL);
    if (covered < uint64_t(frame.width) * frame.height) {
        if ((m_device.stages & VK_PIPELINE_STAGE_COLOR_ATTACHMENT_OUTPUT_BIT) == 0)
            throw internalError("display", "pictures leave a part of a canvas uncovered",
                                "all of it covered where there is no window");
        const VkClearColorValue black{{0, 0, 0, 1}};
        const VkImageSubresourceRange all{VK_IMAGE_ASPECT_COLOR_BIT, 0, 1, 0, 1};
        vkCmdClearColorImage(commands, image.handle, VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL, &black, 1, &all);
        changeLayout(commands, m_device.stages, image.handle, VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL,
                     VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL);
    }
    for (const ShownPicture& picture : frame.pictures) {
        if (picture.x + picture.width > frame.width || picture.y + picture.height > frame.height)
            throw internalError("display", "a picture lies beyond its canvas", "it inside");
        copy(picture, image.handle, picture.x, picture.y, block);
    }
    endCopies();
    changeLayout(commands, m_device.stages, image.handle, VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL,
                 VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL);
}

void Canvas::readBack(VkImage from, uint32_t width, uint32_t height)
{
    const size_t bytes = size_t(width) * height * 4;
    if (read.bytes < bytes) {
        read = {};
        read = VulkanBuffer(m_device, bytes, VK_BUFFER_USAGE_TRANSFER_DST_BIT,
                            VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT | VK_MEMORY_PROPERTY_HOST_COHERENT_BIT);
    }
    VkBufferImageCopy region{};
    region.imageSubresource = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 0, 1};
    region.imageExtent = {width, height, 1};
    vkCmdCopyImageToBuffer(commands, from, VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL, read.handle, 1, &region);
    auto seen = vulkanInfo<VkMemoryBarrier>(VK_STRUCTURE_TYPE_MEMORY_BARRIER);
    seen.srcAccessMask = VK_ACCESS_TRANSFER_WRITE_BIT;
    seen.dstAccessMask = VK_ACCESS_HOST_READ_BIT;
    vkCmdPipelineBarrier(commands, VK_PIPELINE_STAGE_TRANSFER_BIT, VK_PIPELINE_STAGE_HOST_BIT, 0, 1, &seen, 0, nullptr,
                         0, nullptr);
    read_width = width;
    read_height = height;
}

uint32_t fastestCopyFamily(VulkanDevice& device, VkFormat format)
{
    constexpr uint32_t kWidth = 2048, kHeight = 1024;
    // number of copies that are timed for each queue, of which the best counts: the first one is slow
    constexpr int kTries = 3;
    const VulkanBuffer from(device, size_t(kWidth) * kHeight * 4, VK_BUFFER_USAGE_TRANSFER_SRC_BIT,
                            VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT);
    ShownPicture picture;
    picture.width = kWidth;
    picture.height = kHeight;
    const FrameToShow frame{std::span(&picture, 1), kWidth, kHeight, false};
    uint32_t fastest = device.family;
    double least = 0;
    for (const uint32_t family : device.families) {
        device.useFamily(family);
        auto info = vulkanInfo<VkCommandPoolCreateInfo>(VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO);
        info.flags = VK_COMMAND_POOL_CREATE_RESET_COMMAND_BUFFER_BIT;
        info.queueFamilyIndex = family;
        VkCommandPool pool = VK_NULL_HANDLE;
        checkVulkan(vkCreateCommandPool(device.handle, &info, nullptr, &pool), "vkCreateCommandPool");
        double ms = 0;
        {
            Canvas canvas(device, pool, format);
            for (int i = 0; i < kTries; ++i) {
                canvas.draw(frame, [&](uint32_t) { return from.handle; });
                canvas.end();
                auto submit = vulkanInfo<VkSubmitInfo>(VK_STRUCTURE_TYPE_SUBMIT_INFO);
                submit.commandBufferCount = 1;
                submit.pCommandBuffers = &canvas.commands;
                canvas.submit(submit);
                canvas.wait();
                ms = canvas.copyMs();
            }
        }
        vkDestroyCommandPool(device.handle, pool, nullptr);
        if (ms > 0 && (least == 0 || ms < least)) {
            least = ms;
            fastest = family;
        }
    }
    return fastest;
}

} // namespace gsc
