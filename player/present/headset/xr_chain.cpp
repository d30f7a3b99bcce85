// SPDX-License-Identifier: Apache-2.0
#include "player/present/headset/xr_chain.h"

namespace gsc {

XrChain::XrChain(XrSession session, const HeadsetView& view, VkFormat format, XrSwapchainUsageFlags usage)
    : m_width(view.width), m_height(view.height)
{
    auto info = xrInfo<XrSwapchainCreateInfo>(XR_TYPE_SWAPCHAIN_CREATE_INFO);
    info.usageFlags = usage;
    info.format = format;
    info.sampleCount = info.faceCount = info.arraySize = info.mipCount = 1;
    info.width = view.width;
    info.height = view.height;
    checkXr(xrCreateSwapchain(session, &info, &m_handle), "xrCreateSwapchain");
    try {
        const auto images = xrList("xrEnumerateSwapchainImages",
                                   xrInfo<XrSwapchainImageVulkan2KHR>(XR_TYPE_SWAPCHAIN_IMAGE_VULKAN2_KHR),
                                   [&](uint32_t n, uint32_t* count, XrSwapchainImageVulkan2KHR* items) {
                                       return xrEnumerateSwapchainImages(
                                           m_handle, n, count, reinterpret_cast<XrSwapchainImageBaseHeader*>(items));
                                   });
        for (const XrSwapchainImageVulkan2KHR& image : images)
            m_images.push_back(image.image);
    } catch (...) {
        xrDestroySwapchain(m_handle);
        throw;
    }
}

XrChain::~XrChain()
{
    xrDestroySwapchain(m_handle);
}

VkImage XrChain::acquire()
{
    uint32_t index = 0;
    checkXr(xrAcquireSwapchainImage(m_handle, nullptr, &index), "xrAcquireSwapchainImage");
    auto wait = xrInfo<XrSwapchainImageWaitInfo>(XR_TYPE_SWAPCHAIN_IMAGE_WAIT_INFO);
    wait.timeout = XR_INFINITE_DURATION;
    checkXr(xrWaitSwapchainImage(m_handle, &wait), "xrWaitSwapchainImage");
    return m_images.at(index);
}

void XrChain::release()
{
    checkXr(xrReleaseSwapchainImage(m_handle, nullptr), "xrReleaseSwapchainImage");
}

XrSwapchainSubImage XrChain::image() const
{
    XrSwapchainSubImage image{};
    image.swapchain = m_handle;
    image.imageRect.extent = {int32_t(m_width), int32_t(m_height)};
    return image;
}

} // namespace gsc
