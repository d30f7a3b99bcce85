// SPDX-License-Identifier: Apache-2.0
#include "player/present/picture_copy.h"

#include <gsc/error.h>

#include <algorithm>
#include <cstring>

namespace gsc {

namespace {

size_t bytesOf(const ShownPicture& picture)
{
    return size_t(picture.width) * picture.height * 4;
}

} // namespace

void changeLayout(VkCommandBuffer commands, VkPipelineStageFlags stages, VkImage image, VkImageLayout from,
                  VkImageLayout to, VkImageAspectFlags aspect)
{
    auto barrier = vulkanInfo<VkImageMemoryBarrier>(VK_STRUCTURE_TYPE_IMAGE_MEMORY_BARRIER);
    barrier.srcAccessMask = VK_ACCESS_MEMORY_WRITE_BIT;
    barrier.dstAccessMask = VK_ACCESS_MEMORY_READ_BIT | VK_ACCESS_MEMORY_WRITE_BIT;
    barrier.oldLayout = from;
    barrier.newLayout = to;
    barrier.srcQueueFamilyIndex = barrier.dstQueueFamilyIndex = VK_QUEUE_FAMILY_IGNORED;
    barrier.image = image;
    barrier.subresourceRange = {aspect, 0, 1, 0, 1};
    vkCmdPipelineBarrier(commands, stages, stages, 0, 0, nullptr, 0, nullptr, 1, &barrier);
}

PictureCopy::PictureCopy(const VulkanDevice& device, VkCommandPool pool) : m_device(device), m_pool(pool)
{
    auto buffers = vulkanInfo<VkCommandBufferAllocateInfo>(VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO);
    buffers.commandPool = pool;
    buffers.commandBufferCount = 1;
    checkVulkan(vkAllocateCommandBuffers(device.handle, &buffers, &commands), "vkAllocateCommandBuffers");
    makeFence();
    if (device.tick_ns > 0) {
        auto queries = vulkanInfo<VkQueryPoolCreateInfo>(VK_STRUCTURE_TYPE_QUERY_POOL_CREATE_INFO);
        queries.queryType = VK_QUERY_TYPE_TIMESTAMP;
        queries.queryCount = 2;
        checkVulkan(vkCreateQueryPool(device.handle, &queries, nullptr, &m_clock), "vkCreateQueryPool");
    }
}

PictureCopy::~PictureCopy()
{
    vkDestroyQueryPool(m_device.handle, m_clock, nullptr);
    vkDestroyFence(m_device.handle, done, nullptr);
    vkFreeCommandBuffers(m_device.handle, m_pool, 1, &commands);
}

void PictureCopy::makeFence()
{
    auto fence = vulkanInfo<VkFenceCreateInfo>(VK_STRUCTURE_TYPE_FENCE_CREATE_INFO);
    fence.flags = VK_FENCE_CREATE_SIGNALED_BIT;
    checkVulkan(vkCreateFence(m_device.handle, &fence, nullptr, &done), "vkCreateFence");
}

void PictureCopy::submit(const VkSubmitInfo& info)
{
    checkVulkan(vkResetFences(m_device.handle, 1, &done), "vkResetFences");
    const VkResult result = vkQueueSubmit(m_device.queue, 1, &info, done);
    if (result != VK_SUCCESS) { // nothing was submitted, so nothing will set the fence
        vkDestroyFence(m_device.handle, done, nullptr);
        done = VK_NULL_HANDLE;
        makeFence();
    }
    checkVulkan(result, "vkQueueSubmit");
}

void PictureCopy::wait()
{
    constexpr uint64_t kLimit = 10'000'000'000; // longest wait for the GPU, ns
    checkVulkan(vkWaitForFences(m_device.handle, 1, &done, VK_TRUE, kLimit), "vkWaitForFences");
    uint64_t ticks[2] = {};
    if (m_timed && vkGetQueryPoolResults(m_device.handle, m_clock, 0, 2, sizeof ticks, ticks, sizeof ticks[0],
                                         VK_QUERY_RESULT_64_BIT) == VK_SUCCESS)
        m_copy_ms = double(ticks[1] - ticks[0]) * m_device.tick_ns / 1e6;
    m_timed = false;
}

void PictureCopy::reserve(size_t bytes)
{
    if (bytes <= m_staging.bytes)
        return;
    m_staging = {};
    m_staging = VulkanBuffer(m_device, bytes, VK_BUFFER_USAGE_TRANSFER_SRC_BIT,
                             VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT | VK_MEMORY_PROPERTY_HOST_COHERENT_BIT);
}

void PictureCopy::begin(std::span<const ShownPicture> pictures)
{
    size_t bytes = 0;
    for (const ShownPicture& picture : pictures)
        bytes += picture.pixels != nullptr ? bytesOf(picture) : 0;
    reserve(bytes);
    std::byte* at = m_staging.mapped;
    for (const ShownPicture& picture : pictures)
        if (picture.pixels != nullptr) {
            std::memcpy(at, picture.pixels, bytesOf(picture));
            at += bytesOf(picture);
        }
    m_staged = 0;
    shared_value = 0;
    auto info = vulkanInfo<VkCommandBufferBeginInfo>(VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO);
    info.flags = VK_COMMAND_BUFFER_USAGE_ONE_TIME_SUBMIT_BIT;
    checkVulkan(vkBeginCommandBuffer(commands, &info), "vkBeginCommandBuffer");
    if (m_clock != VK_NULL_HANDLE) {
        // the host resets the queries: a queue that only copies cannot
        vkResetQueryPool(m_device.handle, m_clock, 0, 2);
        vkCmdWriteTimestamp(commands, VK_PIPELINE_STAGE_TRANSFER_BIT, m_clock, 0);
    }
}

void PictureCopy::copy(const ShownPicture& picture, VkImage image, uint32_t x, uint32_t y,
                       const std::function<VkBuffer(uint32_t id)>& block)
{
    const bool host = picture.pixels != nullptr;
    VkBufferImageCopy region{};
    region.bufferOffset = host ? m_staged : picture.offset;
    region.imageSubresource = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 0, 1};
    region.imageOffset = {int32_t(x), int32_t(y), 0};
    region.imageExtent = {picture.width, picture.height, 1};
    vkCmdCopyBufferToImage(commands, host ? m_staging.handle : block(picture.block), image,
                           VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL, 1, &region);
    if (host)
        m_staged += bytesOf(picture);
    else
        shared_value = std::max(shared_value, picture.ready);
}

void PictureCopy::endCopies()
{
    if (m_clock == VK_NULL_HANDLE)
        return;
    vkCmdWriteTimestamp(commands, VK_PIPELINE_STAGE_TRANSFER_BIT, m_clock, 1);
    m_timed = true;
}

void PictureCopy::end()
{
    checkVulkan(vkEndCommandBuffer(commands), "vkEndCommandBuffer");
}

} // namespace gsc
