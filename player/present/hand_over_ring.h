// SPDX-License-Identifier: Apache-2.0
// Hands pictures of a GPU over to the display in memory that both share.
#pragma once

#include "player/present/presenter.h"
#include "runtime/cuda/hand_over.h"

#include <array>

namespace gsc {

// Three blocks of shared memory, used in turn: the display may read two frames while a third is handed over.
class HandOverRing {
public:
    // Precondition: memory.sharesMemory(), with `device`. Throws Error(Device).
    HandOverRing(SharedMemory& memory, const DeviceId& device);
    ~HandOverRing();
    HandOverRing(const HandOverRing&) = delete;
    HandOverRing& operator=(const HandOverRing&) = delete;

    // Hands over the pictures of one frame. Their width and height are set; this sets where their pixels lie. `from`
    // points to their pixels in the device's memory, which must stay unchanged for two more frames. Show the pictures
    // before the next call. Throws Error (OutOfMemory, Device).
    void handOver(std::span<ShownPicture> pictures, std::span<const void* const> from);

private:
    SharedMemory& m_memory;
    std::unique_ptr<HandOver> m_device;
    std::array<SharedBlock, 3> m_blocks;
    size_t m_next = 0;
    uint64_t m_value = 0; // value of the shared semaphore at the last frame handed over
};

} // namespace gsc
