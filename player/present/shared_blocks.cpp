// SPDX-License-Identifier: Apache-2.0
#include "player/present/shared_blocks.h"

#include <gsc/error.h>

namespace gsc {

namespace {

template <typename Function>
Function function(const VulkanDevice& device, const char* name)
{
    return reinterpret_cast<Function>(vkGetDeviceProcAddr(device.handle, name));
}

} // namespace

SharedBlocks::SharedBlocks(const VulkanDevice& device) : m_device(device)
{
    makeSemaphore();
}

void SharedBlocks::makeSemaphore()
{
    auto timeline = vulkanInfo<VkSemaphoreTypeCreateInfo>(VK_STRUCTURE_TYPE_SEMAPHORE_TYPE_CREATE_INFO);
    timeline.semaphoreType = VK_SEMAPHORE_TYPE_TIMELINE;
    auto exported = vulkanInfo<VkExportSemaphoreCreateInfo>(VK_STRUCTURE_TYPE_EXPORT_SEMAPHORE_CREATE_INFO, &timeline);
    exported.handleTypes = VK_EXTERNAL_SEMAPHORE_HANDLE_TYPE_OPAQUE_FD_BIT;
    auto info = vulkanInfo<VkSemaphoreCreateInfo>(VK_STRUCTURE_TYPE_SEMAPHORE_CREATE_INFO);
    if (m_device.shares)
        info.pNext = &exported;
    else
        info.pNext = &timeline;
    checkVulkan(vkCreateSemaphore(m_device.handle, &info, nullptr, &m_semaphore), "vkCreateSemaphore");
}

void SharedBlocks::unblock()
{
    uint64_t value = 0;
    if (vkGetSemaphoreCounterValue(m_device.handle, m_semaphore, &value) != VK_SUCCESS || value >= m_waited)
        return;
    auto info = vulkanInfo<VkSemaphoreSignalInfo>(VK_STRUCTURE_TYPE_SEMAPHORE_SIGNAL_INFO);
    info.semaphore = m_semaphore;
    info.value = m_waited;
    (void)vkSignalSemaphore(m_device.handle, &info);
}

SharedBlocks::~SharedBlocks()
{
    m_blocks.clear();
    vkDestroySemaphore(m_device.handle, m_semaphore, nullptr);
}

void SharedBlocks::checkShares() const
{
    if (!m_device.shares)
        throw Error(ErrorCode::Unsupported, "display", m_device.name + " shares no memory with the GPU that draws",
                    "that GPU", "draw into memory of the host");
}

SharedBlock SharedBlocks::make(size_t bytes)
{
    checkShares();
    VulkanBuffer buffer(m_device, bytes, VK_BUFFER_USAGE_TRANSFER_SRC_BIT, VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT, true);
    auto info = vulkanInfo<VkMemoryGetFdInfoKHR>(VK_STRUCTURE_TYPE_MEMORY_GET_FD_INFO_KHR);
    info.memory = buffer.memory;
    info.handleType = VK_EXTERNAL_MEMORY_HANDLE_TYPE_OPAQUE_FD_BIT;
    SharedBlock block{++m_last_block, buffer.allocated, -1};
    checkVulkan(function<PFN_vkGetMemoryFdKHR>(m_device, "vkGetMemoryFdKHR")(m_device.handle, &info, &block.file),
                "vkGetMemoryFdKHR");
    m_blocks.emplace(block.id, std::move(buffer));
    return block;
}

int SharedBlocks::semaphoreFile()
{
    checkShares();
    if (m_exported) { // a new timeline semaphore: whoever opens it expects the value 0
        unblock();
        checkVulkan(vkDeviceWaitIdle(m_device.handle), "vkDeviceWaitIdle");
        vkDestroySemaphore(m_device.handle, m_semaphore, nullptr);
        m_semaphore = VK_NULL_HANDLE;
        m_waited = 0;
        makeSemaphore();
    }
    m_exported = true;
    auto info = vulkanInfo<VkSemaphoreGetFdInfoKHR>(VK_STRUCTURE_TYPE_SEMAPHORE_GET_FD_INFO_KHR);
    info.semaphore = m_semaphore;
    info.handleType = VK_EXTERNAL_SEMAPHORE_HANDLE_TYPE_OPAQUE_FD_BIT;
    int file = -1;
    checkVulkan(function<PFN_vkGetSemaphoreFdKHR>(m_device, "vkGetSemaphoreFdKHR")(m_device.handle, &info, &file),
                "vkGetSemaphoreFdKHR");
    return file;
}

} // namespace gsc
