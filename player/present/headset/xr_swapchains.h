// SPDX-License-Identifier: Apache-2.0
// The images that a headset reads, a swapchain for each view, and the copies of pictures to them.
#pragma once

#include "player/present/headset/xr_chain.h"
#include "player/present/picture_copy.h"
#include "player/present/shared_blocks.h"

namespace gsc {

// Pictures are display-encoded, and a copy changes no byte: so the format must say that it stores sRGB, in the order of the
// bytes.
struct HeadsetFormat {
    VkFormat format;
    PixelFormat pixels;
};
constexpr HeadsetFormat kHeadsetFormats[] = {{VK_FORMAT_R8G8B8A8_SRGB, PixelFormat::Rgba8}, // the first that is offered
                                             {VK_FORMAT_B8G8R8A8_SRGB, PixelFormat::Bgra8}};
constexpr VkFormat kDepthFormat = VK_FORMAT_D32_SFLOAT;

class XrSwapchains {
public:
    XrSwapchains(const XrRuntime& runtime, XrSession session); // throws Error: Unsupported, OutOfMemory, Device
    ~XrSwapchains();
    XrSwapchains(const XrSwapchains&) = delete;
    XrSwapchains& operator=(const XrSwapchains&) = delete;

    // Copies a picture for each view, and its depths where the runtime takes them, to images that the headset reads from the
    // next frame on. Pictures are read until wait() or the next call, depths in this one.
    void take(const HeadsetPictures& pictures, SharedBlocks& blocks);
    void wait() { m_copy->wait(); }

    [[nodiscard]] XrSwapchainSubImage image(size_t view) const { return m_chains[view]->image(); }
    // Depth structure for the view's layer to chain; null where the runtime takes no depths. Lives as long as this.
    [[nodiscard]] const void* depth(size_t view) const { return m_layers.empty() ? nullptr : &m_layers[view]; }
    [[nodiscard]] double copyMs() const { return m_copy->copyMs(); }

private:
    using Chains = std::vector<std::unique_ptr<XrChain>>; // a chain for each view

    void makeDepths(XrSession session);
    void copyDepths(const HeadsetPictures& pictures, const std::vector<VkImage>& images);
    void submit(SharedBlocks& blocks);
    void destroy();

    const XrRuntime& m_runtime;
    VkCommandPool m_pool = VK_NULL_HANDLE;
    std::unique_ptr<PictureCopy> m_copy;
    Chains m_chains, m_depths; // no depths: empty
    VulkanBuffer m_depth_staging;
    std::vector<XrCompositionLayerDepthInfoKHR> m_layers;
};

} // namespace gsc
