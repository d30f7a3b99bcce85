// SPDX-License-Identifier: Apache-2.0
// Pictures of a GPU in memory that the display's Vulkan shares with it.
#pragma once

#include "player/present/presenter.h"
#include "runtime/cuda/hand_over.h"

#include <array>

namespace gsc {

// Three blocks in turn: the display may read two frames while a third is handed over.
class HandOverRing {
public:
    // Precondition: memory.sharesMemory() with that device. Throws Error(Device).
    HandOverRing(SharedMemory& memory, const DeviceId& device);
    ~HandOverRing();
    HandOverRing(const HandOverRing&) = delete;
    HandOverRing& operator=(const HandOverRing&) = delete;

    // Pictures of one frame, whose width and height are set: says where they are. `from`: their pixels in memory of the
    // device, which stays for two more frames. To be shown before the next. Throws Error (OutOfMemory, Device).
    void handOver(std::span<ShownPicture> pictures, std::span<const void* const> from);

private:
    SharedMemory& m_memory;
    std::unique_ptr<HandOver> m_device;
    std::array<SharedBlock, 3> m_blocks;
    size_t m_next = 0;
    uint64_t m_value = 0; // value of the semaphore
};

} // namespace gsc
