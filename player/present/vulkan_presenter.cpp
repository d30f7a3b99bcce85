// SPDX-License-Identifier: Apache-2.0
#include "player/present/canvas.h"
#include "player/present/glfw_window.h"
#include "player/present/overlay_renderer.h"
#include "player/present/shared_blocks.h"
#include "player/present/swapchain.h"
#include "runtime/module/load_module.h"

#include <gsc/error.h>

#include <algorithm>
#include <chrono>
#include <cstring>
#include <thread>

namespace gsc {

namespace {

constexpr uint32_t kCanvases = 2; // number of canvases, each of which the display may still be reading

// Shows frames through Vulkan. Pictures are copied to a canvas. In a window the canvas is then scaled into an image of
// the swapchain, byte for byte if the sizes are equal, and the overlay is drawn over it.
class VulkanPresenter final : public Presenter {
public:
    explicit VulkanPresenter(const PresenterOptions& options)
    {
        if (options.windowed)
            m_window = std::make_unique<GlfwWindow>(options.title, options.width, options.height);
        VulkanDeviceOptions device;
        device.uuid = options.device;
        device.presents = options.windowed;
        if (m_window)
            device.instance_extensions = surfaceExtensions();
        m_device = std::make_unique<VulkanDevice>(device);
        const VkSurfaceKHR surface = m_window ? m_window->makeSurface(m_device->instance) : VK_NULL_HANDLE;
        m_device->open(surface);
        // note: an image of a headset stores sRGB, one of a window stores bytes as they are; a copy changes neither
        const VkFormat format = m_window ? VK_FORMAT_R8G8B8A8_UNORM : VK_FORMAT_R8G8B8A8_SRGB;
        if (!m_window)
            m_device->useFamily(fastestCopyFamily(*m_device, format));
        auto pool = vulkanInfo<VkCommandPoolCreateInfo>(VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO);
        pool.flags = VK_COMMAND_POOL_CREATE_RESET_COMMAND_BUFFER_BIT;
        pool.queueFamilyIndex = m_device->family;
        checkVulkan(vkCreateCommandPool(m_device->handle, &pool, nullptr, &m_pool), "vkCreateCommandPool");
        for (auto& canvas : m_canvases)
            canvas = std::make_unique<Canvas>(*m_device, m_pool, format);
        if (m_window) {
            m_chain = std::make_unique<Swapchain>(*m_device, surface, options.waits_for_display);
            m_overlay = std::make_unique<OverlayRenderer>(*m_device, *m_window, m_chain->overlay, m_pool);
        }
        m_blocks = std::make_unique<SharedBlocks>(*m_device);
    }

    ~VulkanPresenter() override
    {
        if (m_blocks)
            m_blocks->unblock();
        if (m_device->handle != VK_NULL_HANDLE)
            (void)vkDeviceWaitIdle(m_device->handle);
        m_overlay.reset();
        m_chain.reset();
        for (auto& canvas : m_canvases)
            canvas.reset();
        m_blocks.reset();
        vkDestroyCommandPool(m_device->handle, m_pool, nullptr);
        m_device.reset(); // before the window, because the device destroys the window's surface
    }

    [[nodiscard]] bool readsBack() const override { return !m_chain || m_chain->reads_back; }
    [[nodiscard]] std::string deviceName() const override { return m_device->name; }
    [[nodiscard]] bool sharesMemory() const override { return m_device->shares; }

    SharedBlock makeShared(size_t bytes) override { return m_blocks->make(bytes); }

    void freeShared(uint32_t id) override
    {
        finish();
        m_blocks->free(id);
    }

    int semaphoreFile() override { return m_blocks->semaphoreFile(); }
    void importerGone() override { m_blocks->unblock(); }

    WindowInput poll(double seconds) override
    {
        if (m_window) {
            m_input = m_window->poll(seconds);
            return m_input;
        }
        return {};
    }

    void setTitle(const std::string& title) override
    {
        if (m_window)
            glfwSetWindowTitle(m_window->handle(), title.c_str());
    }

    void toggleFullScreen() override
    {
        if (m_window)
            m_window->toggleFullScreen();
    }

    bool show(const FrameToShow& frame, Overlay* overlay) override
    {
        Canvas& canvas = *m_canvases[m_next];
        canvas.wait();
        std::optional<uint32_t> image;
        if (m_chain) {
            image = nextImage(canvas);
            if (!image)
                return false;
        }
        if (m_overlay) {
            Overlay none;
            m_overlay->layOut(overlay != nullptr ? *overlay : none);
        }
        canvas.draw(frame, [this](uint32_t id) { return m_blocks->buffer(id); });
        if (image)
            recordWindow(canvas, frame, m_chain->images[*image]);
        else if (frame.reads_back)
            canvas.readBack(canvas.image.handle, frame.width, frame.height);
        canvas.end();
        submit(canvas, image);
        if (frame.reads_back)
            m_read = m_next;
        m_next = (m_next + 1) % kCanvases;
        if (image && !m_chain->present(*image))
            m_stale = true;
        return true;
    }

    std::vector<std::byte> readBack(uint32_t& width, uint32_t& height) override
    {
        Canvas& canvas = *m_canvases[m_read];
        canvas.wait();
        width = canvas.read_width;
        height = canvas.read_height;
        std::vector<std::byte> bytes(size_t(width) * height * 4);
        std::memcpy(bytes.data(), canvas.read.mapped, bytes.size());
        if (m_chain && !m_chain->red_first)
            for (size_t i = 0; i < bytes.size(); i += 4)
                std::swap(bytes[i], bytes[i + 2]);
        return bytes;
    }

    PresentTimes times() override { return {m_canvases[(m_next + kCanvases - 1) % kCanvases]->copyMs()}; }

    void finish() override
    {
        for (const auto& canvas : m_canvases) {
            const auto until = std::chrono::steady_clock::now() + std::chrono::milliseconds(5);
            // busy waiting at first: a driver that sleeps wakes late
            while (canvas->busy() && std::chrono::steady_clock::now() < until)
                std::this_thread::yield();
            canvas->wait();
        }
    }

private:
    // Returns the index of the next image to draw into, of a swapchain remade if the window's size changed. None while
    // the window is minimised.
    std::optional<uint32_t> nextImage(const Canvas& canvas)
    {
        if (m_input.width == 0 || m_input.height == 0)
            return std::nullopt;
        const bool resized = m_chain->extent.width != m_input.width || m_chain->extent.height != m_input.height;
        if (m_stale || resized || m_chain->images.empty()) {
            checkVulkan(vkDeviceWaitIdle(m_device->handle), "vkDeviceWaitIdle");
            m_stale = false;
            if (!m_chain->resize(m_input.width, m_input.height))
                return std::nullopt;
        }
        const std::optional<uint32_t> image = m_chain->acquire(canvas.acquired);
        m_stale = m_stale || !image;
        return image;
    }

    void recordWindow(Canvas& canvas, const FrameToShow& frame, const Swapchain::Image& image)
    {
        const VkExtent2D to = m_chain->extent;
        changeLayout(canvas.commands, m_device->stages, image.handle, VK_IMAGE_LAYOUT_UNDEFINED,
                     VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL);
        VkImageBlit all{};
        all.srcSubresource = all.dstSubresource = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 0, 1};
        all.srcOffsets[1] = {int32_t(frame.width), int32_t(frame.height), 1};
        all.dstOffsets[1] = {int32_t(to.width), int32_t(to.height), 1};
        const bool same = frame.width == to.width && frame.height == to.height;
        vkCmdBlitImage(canvas.commands, canvas.image.handle, VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL, image.handle,
                       VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL, 1, &all, same ? VK_FILTER_NEAREST : VK_FILTER_LINEAR);
        VkImageLayout layout = VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL;
        if (frame.reads_back) {
            if (!m_chain->reads_back)
                throw internalError("display", "a frame reads back images that cannot be read", "readsBack()");
            changeLayout(canvas.commands, m_device->stages, image.handle, layout, VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL);
            layout = VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL;
            canvas.readBack(image.handle, to.width, to.height);
        }
        changeLayout(canvas.commands, m_device->stages, image.handle, layout, VK_IMAGE_LAYOUT_COLOR_ATTACHMENT_OPTIMAL);
        auto pass = vulkanInfo<VkRenderPassBeginInfo>(VK_STRUCTURE_TYPE_RENDER_PASS_BEGIN_INFO);
        pass.renderPass = m_chain->overlay;
        pass.framebuffer = image.frame;
        pass.renderArea.extent = to;
        vkCmdBeginRenderPass(canvas.commands, &pass, VK_SUBPASS_CONTENTS_INLINE);
        m_overlay->record(canvas.commands);
        vkCmdEndRenderPass(canvas.commands);
    }

    void submit(Canvas& canvas, std::optional<uint32_t> image)
    {
        std::vector<VkSemaphore> waits;
        std::vector<uint64_t> values;
        std::vector<VkPipelineStageFlags> stages;
        const auto wait_for = [&](VkSemaphore semaphore, uint64_t value) {
            waits.push_back(semaphore);
            values.push_back(value);
            stages.push_back(VK_PIPELINE_STAGE_TRANSFER_BIT);
        };
        if (image)
            wait_for(canvas.acquired, 0);
        if (canvas.shared_value > 0)
            wait_for(m_blocks->waited(canvas.shared_value), canvas.shared_value);
        const uint64_t drawn_value = 0;
        auto timeline = vulkanInfo<VkTimelineSemaphoreSubmitInfo>(VK_STRUCTURE_TYPE_TIMELINE_SEMAPHORE_SUBMIT_INFO);
        timeline.waitSemaphoreValueCount = uint32_t(values.size());
        timeline.pWaitSemaphoreValues = values.data();
        timeline.signalSemaphoreValueCount = image ? 1 : 0;
        timeline.pSignalSemaphoreValues = &drawn_value;
        auto info = vulkanInfo<VkSubmitInfo>(VK_STRUCTURE_TYPE_SUBMIT_INFO, &timeline);
        info.waitSemaphoreCount = uint32_t(waits.size());
        info.pWaitSemaphores = waits.data();
        info.pWaitDstStageMask = stages.data();
        info.commandBufferCount = 1;
        info.pCommandBuffers = &canvas.commands;
        info.signalSemaphoreCount = image ? 1 : 0;
        info.pSignalSemaphores = image ? &m_chain->images[*image].drawn : nullptr;
        canvas.submit(info);
    }

    std::unique_ptr<GlfwWindow> m_window;
    std::unique_ptr<VulkanDevice> m_device;
    VkCommandPool m_pool = VK_NULL_HANDLE;
    std::array<std::unique_ptr<Canvas>, kCanvases> m_canvases;
    std::unique_ptr<Swapchain> m_chain;
    std::unique_ptr<OverlayRenderer> m_overlay;
    std::unique_ptr<SharedBlocks> m_blocks;
    WindowInput m_input; // input that the last poll() returned
    uint32_t m_next = 0, m_read = 0;
    bool m_stale = false;
};

std::unique_ptr<Presenter> openPresenter(const PresenterOptions& options)
{
    return std::make_unique<VulkanPresenter>(options);
}

const PresentFunctions kFunctions = {openPresenter};

} // namespace

GSC_EXPORT_MODULE(kFunctions)

} // namespace gsc
