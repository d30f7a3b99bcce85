// SPDX-License-Identifier: Apache-2.0
// The images that a window shows, and how a frame gets into one.
#pragma once

#include "player/present/vulkan_device.h"

namespace gsc {

class Swapchain {
public:
    // Owns the surface.
    Swapchain(const VulkanDevice& device, VkSurfaceKHR surface, bool waits_for_display);
    ~Swapchain();
    Swapchain(const Swapchain&) = delete;
    Swapchain& operator=(const Swapchain&) = delete;

    // Makes the chain for a window of so many pixels, while nothing is in use. Returns false if there is none now.
    // Throws Error.
    bool resize(uint32_t width, uint32_t height);

    // The next image's index; none where the swapchain is out of date. Throws Error(Device).
    std::optional<uint32_t> acquire(VkSemaphore ready);
    bool present(uint32_t image); // after its `drawn`; false where it is out of date

    struct Image {
        VkImage handle = VK_NULL_HANDLE;
        VkImageView view = VK_NULL_HANDLE;
        VkFramebuffer frame = VK_NULL_HANDLE;
        VkSemaphore drawn = VK_NULL_HANDLE;
    };
    std::vector<Image> images;
    VkExtent2D extent{};
    VkFormat format = VK_FORMAT_UNDEFINED;
    VkRenderPass overlay = VK_NULL_HANDLE; // from the copied image to the presented one
    bool red_first = false;                // bytes of a pixel
    bool reads_back = false;               // images can be copied from

private:
    void chooseFormat();
    void makePass();
    void dropImages();

    const VulkanDevice& m_device;
    VkSurfaceKHR m_surface;
    VkSwapchainKHR m_chain = VK_NULL_HANDLE;
    VkColorSpaceKHR m_space{};
    VkPresentModeKHR m_mode = VK_PRESENT_MODE_FIFO_KHR;
};

} // namespace gsc
