// SPDX-License-Identifier: Apache-2.0
// Blocks of a Vulkan device's memory that another program interface opens, and the timeline semaphore that hands them
// over.
#pragma once

#include "player/present/vulkan_device.h"

#include <algorithm>
#include <map>

namespace gsc {

class SharedBlocks {
public:
    explicit SharedBlocks(const VulkanDevice& device);
    ~SharedBlocks();
    SharedBlocks(const SharedBlocks&) = delete;
    SharedBlocks& operator=(const SharedBlocks&) = delete;

    // Implements SharedMemory::makeShared().
    SharedBlock make(size_t bytes);
    void free(uint32_t id) { m_blocks.erase(id); } // frees a block; precondition: nothing reads it any more
    int semaphoreFile();

    [[nodiscard]] VkBuffer buffer(uint32_t id) const { return m_blocks.at(id).handle; }
    // Returns the semaphore, for a submission that waits until it has `value`.
    VkSemaphore waited(uint64_t value)
    {
        m_waited = std::max(m_waited, value);
        return m_semaphore;
    }
    // Signals the semaphore with the value that submissions wait for, in case the renderer no longer can. Call it
    // before waiting for the device.
    void unblock();

private:
    void checkShares() const;
    void makeSemaphore();

    const VulkanDevice& m_device;
    std::map<uint32_t, VulkanBuffer> m_blocks;
    VkSemaphore m_semaphore = VK_NULL_HANDLE;
    bool m_exported = false;
    uint64_t m_waited = 0;
    uint32_t m_last_block = 0;
};

} // namespace gsc
