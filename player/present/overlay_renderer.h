// SPDX-License-Identifier: Apache-2.0
// Draws an overlay with Dear ImGui.
#pragma once

#include "player/present/glfw_window.h"
#include "player/present/overlay.h"
#include "player/present/vulkan_device.h"

namespace gsc {

class OverlayRenderer {
public:
    // From then on ImGui receives the window's input, too. Throws Error.
    OverlayRenderer(const VulkanDevice& device, GlfwWindow& window, VkRenderPass pass, VkCommandPool pool);
    ~OverlayRenderer();
    OverlayRenderer(const OverlayRenderer&) = delete;
    OverlayRenderer& operator=(const OverlayRenderer&) = delete;

    // Lays the overlay out and writes the person's changes into it.
    void layOut(Overlay& overlay);
    // Records the drawing of the laid out overlay, inside a render pass.
    void record(VkCommandBuffer commands);

private:
    void makeFont(float scale);

    const VulkanDevice& m_device;
    VkCommandPool m_pool;
    VkDescriptorPool m_descriptors = VK_NULL_HANDLE;
    GlfwWindow& m_window;
    float m_scale = 0;
    // True if a panel was shown last time, so it may hold the keyboard. True at first: ImGui begins by giving the
    // keyboard to a window of its own.
    bool m_had_panel = true;
};

} // namespace gsc
