// SPDX-License-Identifier: Apache-2.0
// The images that a window shows in turn, and the drawing of a frame into one.
#pragma once

#include "player/present/vulkan_device.h"

namespace gsc {

class Swapchain {
public:
    // Takes the surface and destroys it at the end.
    Swapchain(const VulkanDevice& device, VkSurfaceKHR surface, bool waits_for_display);
    ~Swapchain();
    Swapchain(const Swapchain&) = delete;
    Swapchain& operator=(const Swapchain&) = delete;

    // Makes the images for a window of this size in pixels. Precondition: no image is in use. Returns false if the
    // window can show none now. Throws Error.
    bool resize(uint32_t width, uint32_t height);

    // Returns the index of the next image; none if the swapchain no longer fits the window. Throws Error(Device).
    std::optional<uint32_t> acquire(VkSemaphore ready);
    // shows image number `image` once the semaphore `drawn` of the image is signalled; returns false if the swapchain
    // no longer fits the window
    bool present(uint32_t image);

    struct Image {
        VkImage handle = VK_NULL_HANDLE;
        VkImageView view = VK_NULL_HANDLE;
        VkFramebuffer frame = VK_NULL_HANDLE;
        VkSemaphore drawn = VK_NULL_HANDLE;
    };
    std::vector<Image> images;
    VkExtent2D extent{};
    VkFormat format = VK_FORMAT_UNDEFINED;
    // render pass that draws the overlay over an image that a copy has filled, and leaves it ready to be presented
    VkRenderPass overlay = VK_NULL_HANDLE;
    bool red_first = false;  // order of a pixel's bytes: red, green, blue; false: blue, green, red
    bool reads_back = false; // true: images can be copied to the host

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
