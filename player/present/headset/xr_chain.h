// SPDX-License-Identifier: Apache-2.0
// The swapchain of one view, and the image of it that is written.
#pragma once

#include "player/present/headset/xr_runtime.h"

namespace gsc {

class XrChain {
public:
    XrChain(XrSession session, const HeadsetView& view, VkFormat format, XrSwapchainUsageFlags usage); // throws Error
    ~XrChain();
    XrChain(const XrChain&) = delete;
    XrChain& operator=(const XrChain&) = delete;

    VkImage acquire(); // waits until the headset does not read it
    void release();    // shows the acquired image from the next frame on

    [[nodiscard]] XrSwapchainSubImage image() const; // all of it
    [[nodiscard]] uint32_t width() const { return m_width; }
    [[nodiscard]] uint32_t height() const { return m_height; }

private:
    XrSwapchain m_handle = XR_NULL_HANDLE;
    std::vector<VkImage> m_images;
    uint32_t m_width, m_height;
};

} // namespace gsc
