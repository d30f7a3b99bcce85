// SPDX-License-Identifier: Apache-2.0
#include "player/present/headset/xr_swapchains.h"

#include <gsc/error.h>
#include "player/present/headset/layer_depth.h"

#include <algorithm>

namespace gsc {

XrSwapchains::XrSwapchains(const XrRuntime& runtime, XrSession session) : m_runtime(runtime)
{
    auto pool = vulkanInfo<VkCommandPoolCreateInfo>(VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO);
    pool.flags = VK_COMMAND_POOL_CREATE_RESET_COMMAND_BUFFER_BIT;
    pool.queueFamilyIndex = runtime.device->family;
    checkVulkan(vkCreateCommandPool(runtime.device->handle, &pool, nullptr, &m_pool), "vkCreateCommandPool");
    try {
        m_copy = std::make_unique<PictureCopy>(*runtime.device, m_pool);
        size_t bytes = 0;
        for (const HeadsetView& view : runtime.facts.views)
            bytes += size_t(view.width) * view.height * 4;
        if (!runtime.device->shares)
            m_copy->reserve(bytes);
        const auto taken = std::ranges::find(kHeadsetFormats, runtime.facts.pixels, &HeadsetFormat::pixels);
        for (const HeadsetView& view : runtime.facts.views)
            m_chains.push_back(std::make_unique<XrChain>(session, view, taken->format,
                                                         XR_SWAPCHAIN_USAGE_COLOR_ATTACHMENT_BIT |
                                                             XR_SWAPCHAIN_USAGE_TRANSFER_DST_BIT));
        if (runtime.facts.takes_depth)
            makeDepths(session);
    } catch (...) {
        destroy();
        throw;
    }
}

XrSwapchains::~XrSwapchains()
{
    destroy();
}

void XrSwapchains::destroy()
{
    (void)vkDeviceWaitIdle(m_runtime.device->handle);
    m_chains.clear();
    m_depths.clear();
    m_depth_staging = {};
    m_copy.reset();
    vkDestroyCommandPool(m_runtime.device->handle, m_pool, nullptr);
}

void XrSwapchains::makeDepths(XrSession session)
{
    size_t bytes = 0;
    for (const HeadsetView& view : m_runtime.facts.views) {
        m_depths.push_back(std::make_unique<XrChain>(session, view, kDepthFormat,
                                                     XR_SWAPCHAIN_USAGE_DEPTH_STENCIL_ATTACHMENT_BIT |
                                                         XR_SWAPCHAIN_USAGE_TRANSFER_DST_BIT));
        auto& layer =
            m_layers.emplace_back(xrInfo<XrCompositionLayerDepthInfoKHR>(XR_TYPE_COMPOSITION_LAYER_DEPTH_INFO_KHR));
        layer.subImage = m_depths.back()->image();
        layer.minDepth = 0;
        layer.maxDepth = 1;
        layer.nearZ = kMostDepth; // depth in metres at which the stored value is minDepth
        layer.farZ = kLeastDepth;
        bytes += size_t(view.width) * view.height * sizeof(float);
    }
    m_depth_staging = VulkanBuffer(*m_runtime.device, bytes, VK_BUFFER_USAGE_TRANSFER_SRC_BIT,
                                   VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT | VK_MEMORY_PROPERTY_HOST_COHERENT_BIT);
}

void XrSwapchains::take(const HeadsetPictures& given, SharedBlocks& blocks)
{
    const std::span<const ShownPicture> pictures = given.pictures;
    if (pictures.size() != m_chains.size())
        throw internalError("headset", "not a picture for each view", "one");
    const VkPipelineStageFlags stages = m_runtime.device->stages;
    const auto acquired = [](const Chains& chains) {
        std::vector<VkImage> images;
        for (const std::unique_ptr<XrChain>& chain : chains)
            images.push_back(chain->acquire());
        return images;
    };
    const std::vector<VkImage> images = acquired(m_chains), depths = acquired(m_depths);
    m_copy->wait();
    m_copy->begin(pictures);
    for (const VkImage image : images)
        changeLayout(m_copy->commands, stages, image, VK_IMAGE_LAYOUT_UNDEFINED, VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL);
    for (size_t view = 0; view < images.size(); ++view) {
        if (pictures[view].width != m_chains[view]->width() || pictures[view].height != m_chains[view]->height())
            throw internalError("headset", "a picture has not the size of its view", "that");
        m_copy->copy(pictures[view], images[view], 0, 0, [&](uint32_t id) { return blocks.buffer(id); });
    }
    copyDepths(given, depths);
    m_copy->endCopies();
    for (const VkImage image : images)
        changeLayout(m_copy->commands, stages, image, VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL,
                     VK_IMAGE_LAYOUT_COLOR_ATTACHMENT_OPTIMAL); // layout in which the runtime wants the image back
    m_copy->end();
    submit(blocks);
    for (const Chains* chains : {&m_chains, &m_depths})
        for (const std::unique_ptr<XrChain>& chain : *chains)
            chain->release();
}

// Copies the depths of pictures to images for the runtime. Precondition: nothing reads the staging buffer any more.
void XrSwapchains::copyDepths(const HeadsetPictures& given, const std::vector<VkImage>& images)
{
    auto* const staging = reinterpret_cast<float*>(m_depth_staging.mapped);
    const auto metre = float(given.metre);
    size_t at = 0;
    for (size_t view = 0; view < images.size(); ++view) {
        const ShownPicture& picture = given.pictures[view];
        if (picture.depth == nullptr)
            throw internalError("headset", "a picture has no depths", "some");
        const size_t count = size_t(picture.width) * picture.height;
        std::transform(picture.depth, picture.depth + count, staging + at,
                       [metre](float z) { return layerDepth(z, metre); });
        const VkPipelineStageFlags stages = m_runtime.device->stages | VK_PIPELINE_STAGE_EARLY_FRAGMENT_TESTS_BIT |
                                            // pipeline stage from which on the runtime may use the image
                                            VK_PIPELINE_STAGE_LATE_FRAGMENT_TESTS_BIT;
        changeLayout(m_copy->commands, stages, images[view], VK_IMAGE_LAYOUT_UNDEFINED,
                     VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL, VK_IMAGE_ASPECT_DEPTH_BIT);
        VkBufferImageCopy region{};
        region.bufferOffset = at * sizeof(float);
        region.imageSubresource = {VK_IMAGE_ASPECT_DEPTH_BIT, 0, 0, 1};
        region.imageExtent = {picture.width, picture.height, 1};
        vkCmdCopyBufferToImage(m_copy->commands, m_depth_staging.handle, images[view],
                               VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL, 1, &region);
        changeLayout(m_copy->commands, stages, images[view], VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL,
                     VK_IMAGE_LAYOUT_DEPTH_STENCIL_ATTACHMENT_OPTIMAL, VK_IMAGE_ASPECT_DEPTH_BIT);
        at += count;
    }
}

void XrSwapchains::submit(SharedBlocks& blocks)
{
    const VkSemaphore semaphore = blocks.waited(m_copy->shared_value);
    const VkPipelineStageFlags stage = VK_PIPELINE_STAGE_TRANSFER_BIT;
    const bool waits = m_copy->shared_value > 0;
    auto timeline = vulkanInfo<VkTimelineSemaphoreSubmitInfo>(VK_STRUCTURE_TYPE_TIMELINE_SEMAPHORE_SUBMIT_INFO);
    timeline.waitSemaphoreValueCount = waits ? 1 : 0;
    timeline.pWaitSemaphoreValues = &m_copy->shared_value;
    auto info = vulkanInfo<VkSubmitInfo>(VK_STRUCTURE_TYPE_SUBMIT_INFO, &timeline);
    info.waitSemaphoreCount = timeline.waitSemaphoreValueCount;
    info.pWaitSemaphores = &semaphore;
    info.pWaitDstStageMask = &stage;
    info.commandBufferCount = 1;
    info.pCommandBuffers = &m_copy->commands;
    m_copy->submit(info);
}

} // namespace gsc
