// SPDX-License-Identifier: Apache-2.0
#include "player/present/canvas.h"

#include "format/error.h"

#include <algorithm>
#include <cstring>

namespace gsc {

void changeLayout(VkCommandBuffer commands, VkPipelineStageFlags stages, VkImage image, VkImageLayout from,
                  VkImageLayout to)
{
    auto barrier = vulkanInfo<VkImageMemoryBarrier>(VK_STRUCTURE_TYPE_IMAGE_MEMORY_BARRIER);
    barrier.srcAccessMask = VK_ACCESS_MEMORY_WRITE_BIT;
    barrier.dstAccessMask = VK_ACCESS_MEMORY_READ_BIT | VK_ACCESS_MEMORY_WRITE_BIT;
    barrier.oldLayout = from;
    barrier.newLayout = to;
    barrier.srcQueueFamilyIndex = barrier.dstQueueFamilyIndex = VK_QUEUE_FAMILY_IGNORED;
    barrier.image = image;
    barrier.subresourceRange = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 1, 0, 1};
    vkCmdPipelineBarrier(commands, stages, stages, 0, 0, nullptr, 0, nullptr, 1, &barrier);
}

Canvas::Canvas(const VulkanDevice& device, VkCommandPool pool, VkFormat format)
    : m_device(device), m_pool(pool), m_format(format)
{
    auto buffers = vulkanInfo<VkCommandBufferAllocateInfo>(VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO);
    buffers.commandPool = pool;
    buffers.commandBufferCount = 1;
    checkVulkan(vkAllocateCommandBuffers(device.handle, &buffers, &commands), "vkAllocateCommandBuffers");
    auto fence = vulkanInfo<VkFenceCreateInfo>(VK_STRUCTURE_TYPE_FENCE_CREATE_INFO);
    fence.flags = VK_FENCE_CREATE_SIGNALED_BIT;
    checkVulkan(vkCreateFence(device.handle, &fence, nullptr, &done), "vkCreateFence");
    const auto semaphore = vulkanInfo<VkSemaphoreCreateInfo>(VK_STRUCTURE_TYPE_SEMAPHORE_CREATE_INFO);
    checkVulkan(vkCreateSemaphore(device.handle, &semaphore, nullptr, &acquired), "vkCreateSemaphore");
    if (device.tick_ns > 0) {
        auto queries = vulkanInfo<VkQueryPoolCreateInfo>(VK_STRUCTURE_TYPE_QUERY_POOL_CREATE_INFO);
        queries.queryType = VK_QUERY_TYPE_TIMESTAMP;
        queries.queryCount = 2;
        checkVulkan(vkCreateQueryPool(device.handle, &queries, nullptr, &m_clock), "vkCreateQueryPool");
    }
}

Canvas::~Canvas()
{
    vkDestroyQueryPool(m_device.handle, m_clock, nullptr);
    vkDestroySemaphore(m_device.handle, acquired, nullptr);
    vkDestroyFence(m_device.handle, done, nullptr);
    vkFreeCommandBuffers(m_device.handle, m_pool, 1, &commands);
}

void Canvas::wait()
{
    checkVulkan(vkWaitForFences(m_device.handle, 1, &done, VK_TRUE, ~0ull), "vkWaitForFences");
    uint64_t ticks[2] = {};
    if (m_timed && vkGetQueryPoolResults(m_device.handle, m_clock, 0, 2, sizeof ticks, ticks, sizeof ticks[0],
                                         VK_QUERY_RESULT_64_BIT) == VK_SUCCESS)
        m_copy_ms = double(ticks[1] - ticks[0]) * m_device.tick_ns / 1e6;
    m_timed = false;
}

// Pictures of this process one behind the other where the GPU can read them.
void Canvas::stage(const FrameToShow& frame)
{
    size_t bytes = 0;
    for (const ShownPicture& picture : frame.pictures)
        if (picture.pixels != nullptr)
            bytes += size_t(picture.width) * picture.height * 4;
    if (bytes > m_staging.bytes) {
        m_staging = {};
        m_staging = VulkanBuffer(m_device, bytes, VK_BUFFER_USAGE_TRANSFER_SRC_BIT,
                                 VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT | VK_MEMORY_PROPERTY_HOST_COHERENT_BIT);
    }
    std::byte* at = m_staging.mapped;
    for (const ShownPicture& picture : frame.pictures)
        if (picture.pixels != nullptr) {
            const size_t size = size_t(picture.width) * picture.height * 4;
            std::memcpy(at, picture.pixels, size);
            at += size;
        }
}

void Canvas::begin(const FrameToShow& frame, const std::function<VkBuffer(uint32_t id)>& block)
{
    stage(frame);
    if (image.width != frame.width || image.height != frame.height) {
        image = {};
        image = VulkanImage(m_device, frame.width, frame.height, m_format,
                            VK_IMAGE_USAGE_TRANSFER_SRC_BIT | VK_IMAGE_USAGE_TRANSFER_DST_BIT);
    }
    auto info = vulkanInfo<VkCommandBufferBeginInfo>(VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO);
    info.flags = VK_COMMAND_BUFFER_USAGE_ONE_TIME_SUBMIT_BIT;
    checkVulkan(vkBeginCommandBuffer(commands, &info), "vkBeginCommandBuffer");
    if (m_clock != VK_NULL_HANDLE) {
        vkResetQueryPool(m_device.handle, m_clock, 0, 2); // by the host: a queue that only copies cannot
        vkCmdWriteTimestamp(commands, VK_PIPELINE_STAGE_TRANSFER_BIT, m_clock, 0);
    }
    uint64_t covered = 0;
    for (const ShownPicture& picture : frame.pictures)
        covered += uint64_t(picture.width) * picture.height;
    changeLayout(commands, m_device.stages, image.handle, VK_IMAGE_LAYOUT_UNDEFINED,
                 VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL);
    if (covered < uint64_t(frame.width) * frame.height) {
        if ((m_device.stages & VK_PIPELINE_STAGE_COLOR_ATTACHMENT_OUTPUT_BIT) == 0)
            throw Error(ErrorCode::Internal,
                        "display: pictures leave a part of a canvas uncovered, expected all of it covered where there "
                        "is no window; this is a bug of gsc, please report it");
        const VkClearColorValue black{{0, 0, 0, 1}};
        const VkImageSubresourceRange all{VK_IMAGE_ASPECT_COLOR_BIT, 0, 1, 0, 1};
        vkCmdClearColorImage(commands, image.handle, VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL, &black, 1, &all);
        changeLayout(commands, m_device.stages, image.handle, VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL,
                     VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL);
    }
    size_t staged = 0;
    shared_value = 0;
    for (const ShownPicture& picture : frame.pictures) {
        const bool host = picture.pixels != nullptr;
        if (picture.x + picture.width > frame.width || picture.y + picture.height > frame.height)
            throw Error(ErrorCode::Internal, "display: a picture lies beyond its canvas, expected it inside; this is a "
                                             "bug of gsc, please report it");
        VkBufferImageCopy region{};
        region.bufferOffset = host ? staged : picture.offset;
        region.imageSubresource = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 0, 1};
        region.imageOffset = {int32_t(picture.x), int32_t(picture.y), 0};
        region.imageExtent = {picture.width, picture.height, 1};
        vkCmdCopyBufferToImage(commands, host ? m_staging.handle : block(picture.block), image.handle,
                               VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL, 1, &region);
        if (host)
            staged += size_t(picture.width) * picture.height * 4;
        else
            shared_value = std::max(shared_value, picture.ready);
    }
    if (m_clock != VK_NULL_HANDLE) {
        vkCmdWriteTimestamp(commands, VK_PIPELINE_STAGE_TRANSFER_BIT, m_clock, 1);
        m_timed = true;
    }
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

void Canvas::end()
{
    checkVulkan(vkEndCommandBuffer(commands), "vkEndCommandBuffer");
}

uint32_t fastestCopyFamily(VulkanDevice& device, VkFormat format)
{
    constexpr uint32_t kWidth = 2048, kHeight = 1024;
    constexpr int kTries = 3; // the first of a queue is slow
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
                canvas.begin(frame, [&](uint32_t) { return from.handle; });
                canvas.end();
                auto submit = vulkanInfo<VkSubmitInfo>(VK_STRUCTURE_TYPE_SUBMIT_INFO);
                submit.commandBufferCount = 1;
                submit.pCommandBuffers = &canvas.commands;
                checkVulkan(vkResetFences(device.handle, 1, &canvas.done), "vkResetFences");
                checkVulkan(vkQueueSubmit(device.queue, 1, &submit, canvas.done), "vkQueueSubmit");
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
