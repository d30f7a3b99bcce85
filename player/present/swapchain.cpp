// SPDX-License-Identifier: Apache-2.0
#include "player/present/swapchain.h"

#include <gsc/error.h>

#include <algorithm>

namespace gsc {

Swapchain::Swapchain(const VulkanDevice& device, VkSurfaceKHR surface, bool waits_for_display)
    : m_device(device), m_surface(surface)
{
    chooseFormat();
    makePass();
    if (waits_for_display)
        return; // keeps the mode FIFO, which every driver has
    uint32_t count = 0;
    checkVulkan(vkGetPhysicalDeviceSurfacePresentModesKHR(m_device.physical, m_surface, &count, nullptr),
                "present modes");
    std::vector<VkPresentModeKHR> modes(count);
    checkVulkan(vkGetPhysicalDeviceSurfacePresentModesKHR(m_device.physical, m_surface, &count, modes.data()),
                "present modes");
    for (const VkPresentModeKHR mode : {VK_PRESENT_MODE_MAILBOX_KHR, VK_PRESENT_MODE_IMMEDIATE_KHR})
        if (std::ranges::find(modes, mode) != modes.end())
            m_mode = mode;
}

Swapchain::~Swapchain()
{
    dropImages();
    vkDestroySwapchainKHR(m_device.handle, m_chain, nullptr);
    vkDestroyRenderPass(m_device.handle, overlay, nullptr);
    vkDestroySurfaceKHR(m_device.instance, m_surface, nullptr);
}

// Chooses a format of 8 bits that is shown unchanged: a picture's bytes are display-encoded, so nothing may encode
// them again.
void Swapchain::chooseFormat()
{
    uint32_t count = 0;
    checkVulkan(vkGetPhysicalDeviceSurfaceFormatsKHR(m_device.physical, m_surface, &count, nullptr), "surface formats");
    std::vector<VkSurfaceFormatKHR> formats(count);
    checkVulkan(vkGetPhysicalDeviceSurfaceFormatsKHR(m_device.physical, m_surface, &count, formats.data()),
                "surface formats");
    for (const VkFormat wanted : {VK_FORMAT_R8G8B8A8_UNORM, VK_FORMAT_B8G8R8A8_UNORM})
        for (const VkSurfaceFormatKHR& there : formats)
            if (format == VK_FORMAT_UNDEFINED && there.format == wanted &&
                there.colorSpace == VK_COLOR_SPACE_SRGB_NONLINEAR_KHR) {
                format = wanted;
                m_space = there.colorSpace;
            }
    if (format == VK_FORMAT_UNDEFINED)
        throw Error(ErrorCode::Unsupported, "display",
                    formatString("none of its %u formats has eight bits of sRGB", count), "RGBA8 or BGRA8",
                    "write pictures (gsc-play FILE --out FOLDER)");
    red_first = format == VK_FORMAT_R8G8B8A8_UNORM;
}

void Swapchain::makePass()
{
    VkAttachmentDescription target{};
    target.format = format;
    target.samples = VK_SAMPLE_COUNT_1_BIT;
    target.loadOp = VK_ATTACHMENT_LOAD_OP_LOAD;
    target.storeOp = VK_ATTACHMENT_STORE_OP_STORE;
    target.stencilLoadOp = VK_ATTACHMENT_LOAD_OP_DONT_CARE;
    target.stencilStoreOp = VK_ATTACHMENT_STORE_OP_DONT_CARE;
    target.initialLayout = VK_IMAGE_LAYOUT_COLOR_ATTACHMENT_OPTIMAL;
    target.finalLayout = VK_IMAGE_LAYOUT_PRESENT_SRC_KHR;
    const VkAttachmentReference colour{0, VK_IMAGE_LAYOUT_COLOR_ATTACHMENT_OPTIMAL};
    VkSubpassDescription subpass{};
    subpass.pipelineBindPoint = VK_PIPELINE_BIND_POINT_GRAPHICS;
    subpass.colorAttachmentCount = 1;
    subpass.pColorAttachments = &colour;
    auto info = vulkanInfo<VkRenderPassCreateInfo>(VK_STRUCTURE_TYPE_RENDER_PASS_CREATE_INFO);
    info.attachmentCount = 1;
    info.pAttachments = &target;
    info.subpassCount = 1;
    info.pSubpasses = &subpass;
    checkVulkan(vkCreateRenderPass(m_device.handle, &info, nullptr, &overlay), "vkCreateRenderPass");
}

void Swapchain::dropImages()
{
    for (const Image& image : images) {
        vkDestroyFramebuffer(m_device.handle, image.frame, nullptr);
        vkDestroyImageView(m_device.handle, image.view, nullptr);
        vkDestroySemaphore(m_device.handle, image.drawn, nullptr);
    }
    images.clear();
}

bool Swapchain::resize(uint32_t width, uint32_t height)
{
    VkSurfaceCapabilitiesKHR can{};
    checkVulkan(vkGetPhysicalDeviceSurfaceCapabilitiesKHR(m_device.physical, m_surface, &can), "surface capabilities");
    VkExtent2D wanted = can.currentExtent;
    if (wanted.width == ~0u) // a width of ~0 means that the surface takes the size of the images shown on it
        wanted = {std::clamp(width, can.minImageExtent.width, can.maxImageExtent.width),
                  std::clamp(height, can.minImageExtent.height, can.maxImageExtent.height)};
    dropImages();
    extent = {};
    if (wanted.width == 0 || wanted.height == 0)
        return false;

    const VkSwapchainKHR old = m_chain;
    auto info = vulkanInfo<VkSwapchainCreateInfoKHR>(VK_STRUCTURE_TYPE_SWAPCHAIN_CREATE_INFO_KHR);
    info.surface = m_surface;
    info.minImageCount = can.minImageCount + 1;
    if (can.maxImageCount > 0)
        info.minImageCount = std::min(info.minImageCount, can.maxImageCount);
    info.imageFormat = format;
    info.imageColorSpace = m_space;
    info.imageExtent = wanted;
    info.imageArrayLayers = 1;
    reads_back = (can.supportedUsageFlags & VK_IMAGE_USAGE_TRANSFER_SRC_BIT) != 0;
    info.imageUsage = VK_IMAGE_USAGE_COLOR_ATTACHMENT_BIT | VK_IMAGE_USAGE_TRANSFER_DST_BIT |
                      (reads_back ? VK_IMAGE_USAGE_TRANSFER_SRC_BIT : 0);
    info.preTransform = can.currentTransform;
    info.compositeAlpha = (can.supportedCompositeAlpha & VK_COMPOSITE_ALPHA_OPAQUE_BIT_KHR) != 0
                              ? VK_COMPOSITE_ALPHA_OPAQUE_BIT_KHR
                              : VK_COMPOSITE_ALPHA_INHERIT_BIT_KHR;
    info.presentMode = m_mode;
    info.clipped = VK_TRUE;
    info.oldSwapchain = old;
    m_chain = VK_NULL_HANDLE;
    const VkResult made = vkCreateSwapchainKHR(m_device.handle, &info, nullptr, &m_chain);
    vkDestroySwapchainKHR(m_device.handle, old, nullptr);
    checkVulkan(made, "vkCreateSwapchainKHR");
    extent = wanted;

    uint32_t count = 0;
    checkVulkan(vkGetSwapchainImagesKHR(m_device.handle, m_chain, &count, nullptr), "vkGetSwapchainImagesKHR");
    std::vector<VkImage> handles(count);
    checkVulkan(vkGetSwapchainImagesKHR(m_device.handle, m_chain, &count, handles.data()), "vkGetSwapchainImagesKHR");
    for (const VkImage handle : handles) {
        Image& image = images.emplace_back();
        image.handle = handle;
        auto view = vulkanInfo<VkImageViewCreateInfo>(VK_STRUCTURE_TYPE_IMAGE_VIEW_CREATE_INFO);
        view.image = handle;
        view.viewType = VK_IMAGE_VIEW_TYPE_2D;
        view.format = format;
        view.subresourceRange = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 1, 0, 1};
        checkVulkan(vkCreateImageView(m_device.handle, &view, nullptr, &image.view), "vkCreateImageView");
        auto frame = vulkanInfo<VkFramebufferCreateInfo>(VK_STRUCTURE_TYPE_FRAMEBUFFER_CREATE_INFO);
        frame.renderPass = overlay;
        frame.attachmentCount = 1;
        frame.pAttachments = &image.view;
        frame.width = extent.width;
        frame.height = extent.height;
        frame.layers = 1;
        checkVulkan(vkCreateFramebuffer(m_device.handle, &frame, nullptr, &image.frame), "vkCreateFramebuffer");
        const auto semaphore = vulkanInfo<VkSemaphoreCreateInfo>(VK_STRUCTURE_TYPE_SEMAPHORE_CREATE_INFO);
        checkVulkan(vkCreateSemaphore(m_device.handle, &semaphore, nullptr, &image.drawn), "vkCreateSemaphore");
    }
    return true;
}

std::optional<uint32_t> Swapchain::acquire(VkSemaphore ready)
{
    uint32_t image = 0;
    const VkResult result = vkAcquireNextImageKHR(m_device.handle, m_chain, ~0ull, ready, VK_NULL_HANDLE, &image);
    if (result == VK_ERROR_OUT_OF_DATE_KHR)
        return std::nullopt;
    checkVulkan(result, "vkAcquireNextImageKHR");
    return image;
}

bool Swapchain::present(uint32_t image)
{
    auto info = vulkanInfo<VkPresentInfoKHR>(VK_STRUCTURE_TYPE_PRESENT_INFO_KHR);
    info.waitSemaphoreCount = 1;
    info.pWaitSemaphores = &images[image].drawn;
    info.swapchainCount = 1;
    info.pSwapchains = &m_chain;
    info.pImageIndices = &image;
    const VkResult result = vkQueuePresentKHR(m_device.queue, &info);
    if (result == VK_ERROR_OUT_OF_DATE_KHR || result == VK_SUBOPTIMAL_KHR)
        return false;
    checkVulkan(result, "vkQueuePresentKHR");
    return true;
}

} // namespace gsc
