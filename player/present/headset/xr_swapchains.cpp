// SPDX-License-Identifier: Apache-2.0
#include "player/present/headset/xr_swapchains.h"

#include "format/error.h"

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
        for (const HeadsetView& view : runtime.facts.views) {
            Chain& chain = m_chains.emplace_back();
            chain.width = view.width;
            chain.height = view.height;
            auto info = xrInfo<XrSwapchainCreateInfo>(XR_TYPE_SWAPCHAIN_CREATE_INFO);
            info.usageFlags = XR_SWAPCHAIN_USAGE_COLOR_ATTACHMENT_BIT | XR_SWAPCHAIN_USAGE_TRANSFER_DST_BIT;
            info.format = kHeadsetFormat;
            info.sampleCount = info.faceCount = info.arraySize = info.mipCount = 1;
            info.width = view.width;
            info.height = view.height;
            checkXr(xrCreateSwapchain(session, &info, &chain.handle), "xrCreateSwapchain");
            const auto images = xrList(
                "xrEnumerateSwapchainImages", xrInfo<XrSwapchainImageVulkan2KHR>(XR_TYPE_SWAPCHAIN_IMAGE_VULKAN2_KHR),
                [&](uint32_t n, uint32_t* count, XrSwapchainImageVulkan2KHR* items) {
                    return xrEnumerateSwapchainImages(chain.handle, n, count,
                                                      reinterpret_cast<XrSwapchainImageBaseHeader*>(items));
                });
            for (const XrSwapchainImageVulkan2KHR& image : images)
                chain.images.push_back(image.image);
        }
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
    for (const Chain& chain : m_chains)
        if (chain.handle != XR_NULL_HANDLE)
            xrDestroySwapchain(chain.handle);
    m_copy.reset();
    vkDestroyCommandPool(m_runtime.device->handle, m_pool, nullptr);
}

void XrSwapchains::take(std::span<const ShownPicture> pictures, SharedBlocks& blocks)
{
    if (pictures.size() != m_chains.size())
        throw Error(ErrorCode::Internal, "headset: not a picture for each view, expected one; this is a bug of gsc, "
                                         "please report it");
    const VkPipelineStageFlags stages = m_runtime.device->stages;
    std::vector<VkImage> images;
    for (const Chain& chain : m_chains) {
        uint32_t index = 0;
        checkXr(xrAcquireSwapchainImage(chain.handle, nullptr, &index), "xrAcquireSwapchainImage");
        auto wait = xrInfo<XrSwapchainImageWaitInfo>(XR_TYPE_SWAPCHAIN_IMAGE_WAIT_INFO);
        wait.timeout = XR_INFINITE_DURATION;
        checkXr(xrWaitSwapchainImage(chain.handle, &wait), "xrWaitSwapchainImage");
        images.push_back(chain.images.at(index));
    }
    m_copy->wait();
    m_copy->begin(pictures);
    for (const VkImage image : images)
        changeLayout(m_copy->commands, stages, image, VK_IMAGE_LAYOUT_UNDEFINED, VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL);
    for (size_t view = 0; view < images.size(); ++view) {
        if (pictures[view].width != m_chains[view].width || pictures[view].height != m_chains[view].height)
            throw Error(ErrorCode::Internal,
                        "headset: a picture has not the size of its view, expected that; this is a "
                        "bug of gsc, please report it");
        m_copy->copy(pictures[view], images[view], 0, 0, [&](uint32_t id) { return blocks.buffer(id); });
    }
    m_copy->endCopies();
    for (const VkImage image : images)
        changeLayout(m_copy->commands, stages, image, VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL,
                     VK_IMAGE_LAYOUT_COLOR_ATTACHMENT_OPTIMAL); // as the runtime wants it back
    m_copy->end();
    submit(blocks);
    for (const Chain& chain : m_chains)
        checkXr(xrReleaseSwapchainImage(chain.handle, nullptr), "xrReleaseSwapchainImage");
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

XrSwapchainSubImage XrSwapchains::image(size_t view) const
{
    const Chain& chain = m_chains[view];
    XrSwapchainSubImage image{};
    image.swapchain = chain.handle;
    image.imageRect.extent = {int32_t(chain.width), int32_t(chain.height)};
    return image;
}

} // namespace gsc
