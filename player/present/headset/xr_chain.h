// SPDX-License-Identifier: Apache-2.0
// The OpenXR swapchain of one view, and the one of its images that is being written.
#pragma once

#include "player/present/headset/xr_runtime.h"

namespace gsc {

class XrChain {
public:
    // makes a swapchain in the size of the view; throws Error
    XrChain(XrSession session, const HeadsetView& view, VkFormat format, XrSwapchainUsageFlags usage);
    ~XrChain();
    XrChain(const XrChain&) = delete;
    XrChain& operator=(const XrChain&) = delete;

    VkImage acquire(); // returns the next image, after waiting until the headset no longer reads it
    void release();    // gives the acquired image to the headset, which shows it from the next frame on

    [[nodiscard]] XrSwapchainSubImage image() const; // returns the description of the whole image that a layer needs
    [[nodiscard]] uint32_t width() const { return m_width; }
    [[nodiscard]] uint32_t height() const { return m_height; }

private:
    XrSwapchain m_handle = XR_NULL_HANDLE;
    std::vector<VkImage> m_images;
    uint32_t m_width, m_height;
};

} // namespace gsc
