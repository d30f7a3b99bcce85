// SPDX-License-Identifier: Apache-2.0
// The images that a headset reads, in a swapchain for each view, and the copies of pictures to them.
#pragma once

#include "player/present/headset/xr_chain.h"
#include "player/present/picture_copy.h"
#include "player/present/shared_blocks.h"

namespace gsc {

// A format of images that a headset reads, and pixels of pictures that fit it. Pictures are display-encoded and copied
// byte by byte, so the format must be an sRGB one with its channels in the order of the bytes.
struct HeadsetFormat {
    VkFormat format;
    PixelFormat pixels;
};
// the first of these that the runtime offers is used
constexpr HeadsetFormat kHeadsetFormats[] = {{VK_FORMAT_R8G8B8A8_SRGB, PixelFormat::Rgba8},
                                             {VK_FORMAT_B8G8R8A8_SRGB, PixelFormat::Bgra8}};
constexpr VkFormat kDepthFormat = VK_FORMAT_D32_SFLOAT;

class XrSwapchains {
public:
    // makes the swapchains; throws Error: Unsupported, OutOfMemory, Device
    XrSwapchains(const XrRuntime& runtime, XrSession session);
    ~XrSwapchains();
    XrSwapchains(const XrSwapchains&) = delete;
    XrSwapchains& operator=(const XrSwapchains&) = delete;

    // Copies a picture for each view, and its depths if the runtime takes them, to images that the headset reads from
    // the next frame on. Pictures are read until wait() or the next take(); depths are read before this returns.
    void take(const HeadsetPictures& pictures, SharedBlocks& blocks);
    void wait() { m_copy->wait(); }

    [[nodiscard]] XrSwapchainSubImage image(size_t view) const { return m_chains[view]->image(); }
    // Depth structure to chain to the layer of a view; null if the runtime takes no depths. It lives as long as this
    // object.
    [[nodiscard]] const void* depth(size_t view) const { return m_layers.empty() ? nullptr : &m_layers[view]; }
    [[nodiscard]] double copyMs() const { return m_copy->copyMs(); }

private:
    using Chains = std::vector<std::unique_ptr<XrChain>>; // one swapchain for each view

    void makeDepths(XrSession session);
    void copyDepths(const HeadsetPictures& pictures, const std::vector<VkImage>& images);
    void submit(SharedBlocks& blocks);
    void destroy();

    const XrRuntime& m_runtime;
    VkCommandPool m_pool = VK_NULL_HANDLE;
    std::unique_ptr<PictureCopy> m_copy;
    Chains m_chains, m_depths; // images of pictures; images of depths, empty if the runtime takes no depths
    VulkanBuffer m_depth_staging;
    std::vector<XrCompositionLayerDepthInfoKHR> m_layers;
};

} // namespace gsc
