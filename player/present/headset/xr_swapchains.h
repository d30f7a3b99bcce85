// SPDX-License-Identifier: Apache-2.0
// The images that a headset reads, a swapchain for each view, and the copies of pictures to them.
#pragma once

#include "player/present/headset/xr_runtime.h"
#include "player/present/picture_copy.h"
#include "player/present/shared_blocks.h"

namespace gsc {

// Pictures are display-encoded, and a copy changes no byte: so the format must say that it stores sRGB, red first.
constexpr VkFormat kHeadsetFormat = VK_FORMAT_R8G8B8A8_SRGB;

class XrSwapchains {
public:
    XrSwapchains(const XrRuntime& runtime, XrSession session); // throws Error: Unsupported, OutOfMemory, Device
    ~XrSwapchains();
    XrSwapchains(const XrSwapchains&) = delete;
    XrSwapchains& operator=(const XrSwapchains&) = delete;

    // Copies a picture for each view to an image that the headset reads from the next frame on. Pictures are read until
    // wait() or the next call.
    void take(std::span<const ShownPicture> pictures, SharedBlocks& blocks);
    void wait() { m_copy->wait(); }

    [[nodiscard]] XrSwapchainSubImage image(size_t view) const;
    [[nodiscard]] double copyMs() const { return m_copy->copyMs(); }

private:
    struct Chain {
        XrSwapchain handle = XR_NULL_HANDLE;
        std::vector<VkImage> images;
        uint32_t width = 0, height = 0;
    };

    void submit(SharedBlocks& blocks);
    void destroy();

    const XrRuntime& m_runtime;
    VkCommandPool m_pool = VK_NULL_HANDLE;
    std::unique_ptr<PictureCopy> m_copy;
    std::vector<Chain> m_chains;
};

} // namespace gsc
