// SPDX-License-Identifier: Apache-2.0
#include "gpu.h"

#include <stdexcept>
#include <string>
#include <utility>

namespace gsc::fake_xr {

namespace {

VkImageUsageFlags usageOf(XrSwapchainUsageFlags wanted)
{
    constexpr std::pair<XrSwapchainUsageFlags, VkImageUsageFlags> kUsages[] = {
        {XR_SWAPCHAIN_USAGE_COLOR_ATTACHMENT_BIT, VK_IMAGE_USAGE_COLOR_ATTACHMENT_BIT},
        {XR_SWAPCHAIN_USAGE_DEPTH_STENCIL_ATTACHMENT_BIT, VK_IMAGE_USAGE_DEPTH_STENCIL_ATTACHMENT_BIT},
        {XR_SWAPCHAIN_USAGE_UNORDERED_ACCESS_BIT, VK_IMAGE_USAGE_STORAGE_BIT},
        {XR_SWAPCHAIN_USAGE_TRANSFER_SRC_BIT, VK_IMAGE_USAGE_TRANSFER_SRC_BIT},
        {XR_SWAPCHAIN_USAGE_TRANSFER_DST_BIT, VK_IMAGE_USAGE_TRANSFER_DST_BIT},
        {XR_SWAPCHAIN_USAGE_SAMPLED_BIT, VK_IMAGE_USAGE_SAMPLED_BIT},
        {XR_SWAPCHAIN_USAGE_INPUT_ATTACHMENT_BIT_MND, VK_IMAGE_USAGE_INPUT_ATTACHMENT_BIT}};
    // reading back needs it
    VkImageUsageFlags usage = VK_IMAGE_USAGE_TRANSFER_SRC_BIT;
    for (const auto& [xr, vk] : kUsages)
        if ((wanted & xr) != 0)
            usage |= vk;
    return usage;
}

VkImageCreateInfo imageInfo(const XrSwapchainCreateInfo& info)
{
    const bool depth = pixelFormat(info.format)->depth;
    VkImageCreateInfo image{};
    image.sType = VK_STRUCTURE_TYPE_IMAGE_CREATE_INFO;
    image.flags =
        (info.usageFlags & XR_SWAPCHAIN_USAGE_MUTABLE_FORMAT_BIT) != 0 ? VK_IMAGE_CREATE_MUTABLE_FORMAT_BIT : 0;
    image.imageType = VK_IMAGE_TYPE_2D;
    image.format = VkFormat(info.format);
    image.extent = {info.width, info.height, 1};
    image.mipLevels = info.mipCount;
    image.arrayLayers = info.arraySize;
    image.samples = VK_SAMPLE_COUNT_1_BIT;
    image.tiling = VK_IMAGE_TILING_OPTIMAL;
    // an image is handed out in an attachment's layout, which only an attachment may have
    image.usage = usageOf(info.usageFlags) | VkImageUsageFlags(depth ? VK_IMAGE_USAGE_DEPTH_STENCIL_ATTACHMENT_BIT
                                                                     : VK_IMAGE_USAGE_COLOR_ATTACHMENT_BIT);
    return image;
}

VkImageMemoryBarrier barrierOf(VkImage image, bool depth, VkImageLayout from, VkImageLayout to)
{
    VkImageMemoryBarrier barrier{};
    barrier.sType = VK_STRUCTURE_TYPE_IMAGE_MEMORY_BARRIER;
    barrier.srcAccessMask = VK_ACCESS_MEMORY_WRITE_BIT;
    barrier.dstAccessMask = VK_ACCESS_MEMORY_READ_BIT | VK_ACCESS_MEMORY_WRITE_BIT;
    barrier.oldLayout = from;
    barrier.newLayout = to;
    barrier.srcQueueFamilyIndex = barrier.dstQueueFamilyIndex = VK_QUEUE_FAMILY_IGNORED;
    barrier.image = image;
    barrier.subresourceRange = {VkImageAspectFlags(depth ? VK_IMAGE_ASPECT_DEPTH_BIT : VK_IMAGE_ASPECT_COLOR_BIT), 0,
                                VK_REMAINING_MIP_LEVELS, 0, VK_REMAINING_ARRAY_LAYERS};
    return barrier;
}

VkImageLayout attachmentLayout(bool depth)
{
    return depth ? VK_IMAGE_LAYOUT_DEPTH_STENCIL_ATTACHMENT_OPTIMAL : VK_IMAGE_LAYOUT_COLOR_ATTACHMENT_OPTIMAL;
}

} // namespace

std::optional<PixelFormat> pixelFormat(int64_t format)
{
    static constexpr PixelFormat kFormats[] = {{VK_FORMAT_R8G8B8A8_UNORM, 4, false, false, true},
                                               {VK_FORMAT_R8G8B8A8_SRGB, 4, false, false, true},
                                               {VK_FORMAT_B8G8R8A8_UNORM, 4, false, true, true},
                                               {VK_FORMAT_B8G8R8A8_SRGB, 4, false, true, true},
                                               {VK_FORMAT_A2B10G10R10_UNORM_PACK32, 4, false, false, false},
                                               {VK_FORMAT_R16G16B16A16_SFLOAT, 8, false, false, false},
                                               {VK_FORMAT_D16_UNORM, 2, true, false, false},
                                               {VK_FORMAT_D32_SFLOAT, 4, true, false, false}};
    for (const PixelFormat& known : kFormats)
        if (int64_t(known.format) == format)
            return known;
    return std::nullopt;
}

Gpu::Gpu(PFN_vkGetInstanceProcAddr loader, const XrGraphicsBindingVulkan2KHR& binding)
    : m_physical(binding.physicalDevice), m_device(binding.device)
{
#define GSC_FAKE_XR_LOAD(name)                                                                                         \
    name = reinterpret_cast<PFN_##name>(loader(binding.instance, #name));                                              \
    if (name == nullptr)                                                                                               \
        throw std::runtime_error("the application's Vulkan lacks " #name);
    GSC_FAKE_XR_VULKAN(GSC_FAKE_XR_LOAD)
#undef GSC_FAKE_XR_LOAD
    vkGetDeviceQueue(m_device, binding.queueFamilyIndex, binding.queueIndex, &m_queue);
    VkCommandPoolCreateInfo pool{};
    pool.sType = VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO;
    pool.flags = VK_COMMAND_POOL_CREATE_RESET_COMMAND_BUFFER_BIT;
    pool.queueFamilyIndex = binding.queueFamilyIndex;
    check(vkCreateCommandPool(m_device, &pool, nullptr, &m_pool), "vkCreateCommandPool");
    VkCommandBufferAllocateInfo commands{};
    commands.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO;
    commands.commandPool = m_pool;
    commands.level = VK_COMMAND_BUFFER_LEVEL_PRIMARY;
    commands.commandBufferCount = 1;
    check(vkAllocateCommandBuffers(m_device, &commands, &m_commands), "vkAllocateCommandBuffers");
    VkFenceCreateInfo fence{};
    fence.sType = VK_STRUCTURE_TYPE_FENCE_CREATE_INFO;
    check(vkCreateFence(m_device, &fence, nullptr, &m_fence), "vkCreateFence");
}

Gpu::~Gpu()
{
    vkDeviceWaitIdle(m_device);
    vkDestroyBuffer(m_device, m_buffer, nullptr);
    vkFreeMemory(m_device, m_buffer_memory, nullptr);
    vkDestroyFence(m_device, m_fence, nullptr);
    vkDestroyCommandPool(m_device, m_pool, nullptr);
}

void Gpu::check(VkResult result, const char* what) const
{
    if (result != VK_SUCCESS)
        throw std::runtime_error(std::string(what) + " failed with Vulkan's code " + std::to_string(result));
}

uint32_t Gpu::memoryType(uint32_t bits, VkMemoryPropertyFlags wanted, VkMemoryPropertyFlags better) const
{
    VkPhysicalDeviceMemoryProperties memory;
    vkGetPhysicalDeviceMemoryProperties(m_physical, &memory);
    for (const VkMemoryPropertyFlags flags : {wanted | better, wanted})
        for (uint32_t i = 0; i < memory.memoryTypeCount; ++i)
            if ((bits >> i & 1) != 0 && (memory.memoryTypes[i].propertyFlags & flags) == flags)
                return i;
    throw std::runtime_error("the device has no memory of the wanted kind");
}

bool Gpu::supports(const XrSwapchainCreateInfo& info) const
{
    const VkImageCreateInfo image = imageInfo(info);
    VkImageFormatProperties limits;
    return vkGetPhysicalDeviceImageFormatProperties(m_physical, image.format, image.imageType, image.tiling,
                                                    image.usage, image.flags, &limits) == VK_SUCCESS &&
           image.extent.width <= limits.maxExtent.width && image.extent.height <= limits.maxExtent.height &&
           image.arrayLayers <= limits.maxArrayLayers && image.mipLevels <= limits.maxMipLevels;
}

GpuImage Gpu::createImage(const XrSwapchainCreateInfo& info)
{
    const VkImageCreateInfo image_info = imageInfo(info);
    GpuImage made;
    check(vkCreateImage(m_device, &image_info, nullptr, &made.image), "vkCreateImage");
    VkMemoryRequirements needs;
    vkGetImageMemoryRequirements(m_device, made.image, &needs);
    VkMemoryAllocateInfo memory{};
    memory.sType = VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO;
    memory.allocationSize = needs.size;
    memory.memoryTypeIndex = memoryType(needs.memoryTypeBits, VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT);
    check(vkAllocateMemory(m_device, &memory, nullptr, &made.memory), "vkAllocateMemory");
    check(vkBindImageMemory(m_device, made.image, made.memory, 0), "vkBindImageMemory");
    return made;
}

void Gpu::destroyImages(std::vector<GpuImage>& images)
{
    vkDeviceWaitIdle(m_device);
    for (const GpuImage& each : images) {
        vkDestroyImage(m_device, each.image, nullptr);
        vkFreeMemory(m_device, each.memory, nullptr);
    }
    images.clear();
}

void Gpu::begin()
{
    VkCommandBufferBeginInfo info{};
    info.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO;
    info.flags = VK_COMMAND_BUFFER_USAGE_ONE_TIME_SUBMIT_BIT;
    check(vkBeginCommandBuffer(m_commands, &info), "vkBeginCommandBuffer");
}

void Gpu::submitAndWait()
{
    check(vkEndCommandBuffer(m_commands), "vkEndCommandBuffer");
    VkSubmitInfo submit{};
    submit.sType = VK_STRUCTURE_TYPE_SUBMIT_INFO;
    submit.commandBufferCount = 1;
    submit.pCommandBuffers = &m_commands;
    check(vkQueueSubmit(m_queue, 1, &submit, m_fence), "vkQueueSubmit");
    check(vkWaitForFences(m_device, 1, &m_fence, VK_TRUE, ~0ull), "vkWaitForFences");
    check(vkResetFences(m_device, 1, &m_fence), "vkResetFences");
}

void Gpu::layOut(GpuImage& image, const XrSwapchainCreateInfo& info)
{
    const bool depth = pixelFormat(info.format)->depth;
    begin();
    const VkImageMemoryBarrier barrier =
        barrierOf(image.image, depth, VK_IMAGE_LAYOUT_UNDEFINED, attachmentLayout(depth));
    constexpr VkPipelineStageFlags kAll = VK_PIPELINE_STAGE_ALL_COMMANDS_BIT;
    vkCmdPipelineBarrier(m_commands, kAll, kAll, 0, 0, nullptr, 0, nullptr, 1, &barrier);
    submitAndWait();
    image.laid_out = true;
}

void Gpu::growBuffer(VkDeviceSize bytes)
{
    if (bytes <= m_buffer_bytes)
        return;
    vkDestroyBuffer(m_device, std::exchange(m_buffer, VK_NULL_HANDLE), nullptr);
    vkFreeMemory(m_device, std::exchange(m_buffer_memory, VK_NULL_HANDLE), nullptr);
    m_buffer_bytes = 0;
    VkBufferCreateInfo info{};
    info.sType = VK_STRUCTURE_TYPE_BUFFER_CREATE_INFO;
    info.size = bytes;
    info.usage = VK_BUFFER_USAGE_TRANSFER_DST_BIT;
    check(vkCreateBuffer(m_device, &info, nullptr, &m_buffer), "vkCreateBuffer");
    VkMemoryRequirements needs;
    vkGetBufferMemoryRequirements(m_device, m_buffer, &needs);
    VkMemoryAllocateInfo memory{};
    memory.sType = VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO;
    memory.allocationSize = needs.size;
    constexpr VkMemoryPropertyFlags kHost = VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT | VK_MEMORY_PROPERTY_HOST_COHERENT_BIT;
    // reading memory that is not cached is slow
    memory.memoryTypeIndex = memoryType(needs.memoryTypeBits, kHost, VK_MEMORY_PROPERTY_HOST_CACHED_BIT);
    check(vkAllocateMemory(m_device, &memory, nullptr, &m_buffer_memory), "vkAllocateMemory");
    check(vkBindBufferMemory(m_device, m_buffer, m_buffer_memory, 0), "vkBindBufferMemory");
    check(vkMapMemory(m_device, m_buffer_memory, 0, VK_WHOLE_SIZE, 0, &m_mapped), "vkMapMemory");
    m_buffer_bytes = bytes;
}

const std::byte* Gpu::read(const GpuImage& image, const PixelFormat& format, uint32_t layer, const XrRect2Di& rect)
{
    growBuffer(VkDeviceSize(rect.extent.width) * VkDeviceSize(rect.extent.height) * format.bytes);
    constexpr VkPipelineStageFlags kAll = VK_PIPELINE_STAGE_ALL_COMMANDS_BIT;
    constexpr VkImageLayout kSource = VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL;
    const VkImageLayout attachment = attachmentLayout(format.depth);
    begin();
    const VkImageMemoryBarrier before = barrierOf(image.image, format.depth, attachment, kSource);
    vkCmdPipelineBarrier(m_commands, kAll, kAll, 0, 0, nullptr, 0, nullptr, 1, &before);
    VkBufferImageCopy region{};
    region.imageSubresource = {before.subresourceRange.aspectMask, 0, layer, 1};
    region.imageOffset = {rect.offset.x, rect.offset.y, 0};
    region.imageExtent = {uint32_t(rect.extent.width), uint32_t(rect.extent.height), 1};
    vkCmdCopyImageToBuffer(m_commands, image.image, kSource, m_buffer, 1, &region);
    const VkImageMemoryBarrier after = barrierOf(image.image, format.depth, kSource, attachment);
    VkBufferMemoryBarrier host{};
    host.sType = VK_STRUCTURE_TYPE_BUFFER_MEMORY_BARRIER;
    host.srcAccessMask = VK_ACCESS_TRANSFER_WRITE_BIT;
    host.dstAccessMask = VK_ACCESS_HOST_READ_BIT;
    host.srcQueueFamilyIndex = host.dstQueueFamilyIndex = VK_QUEUE_FAMILY_IGNORED;
    host.buffer = m_buffer;
    host.size = VK_WHOLE_SIZE;
    vkCmdPipelineBarrier(m_commands, kAll, kAll | VK_PIPELINE_STAGE_HOST_BIT, 0, 0, nullptr, 1, &host, 1, &after);
    submitAndWait();
    return static_cast<const std::byte*>(m_mapped);
}

} // namespace gsc::fake_xr
