// SPDX-License-Identifier: Apache-2.0
// Hands pictures of a GPU over to another program interface that has memory and semaphores on the same GPU, such as
// Vulkan. Nothing here names a CUDA header.
#pragma once

#include <gsc/device.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>

namespace gsc {

// Returns the UUID by which CUDA and Vulkan identify a GPU; none if the device is no GPU, or without CUDA.
std::optional<std::array<unsigned char, 16>> deviceUuid(const DeviceId& device);

// Used from one thread at a time. All functions throw Error(Device).
class HandOver {
public:
    virtual ~HandOver() = default; // the destructor waits for copies and unmaps the blocks

    // Maps a block of the other interface's memory. `file` is an opaque file descriptor, which this object owns from
    // now on.
    virtual void addBlock(uint32_t id, int file, size_t bytes) = 0;
    virtual void dropBlock(uint32_t id) = 0; // waits for copies to the block and unmaps it

    // Begins to copy from device memory to a block. The content of `from` must be complete, and must not change until
    // the value of a later signal() has been waited for.
    virtual void copy(uint32_t id, size_t offset, const void* from, size_t bytes) = 0;
    // Sets the other interface's timeline semaphore to `value` when all earlier copies are done. Values must rise.
    virtual void signal(uint64_t value) = 0;
};

// Opens the other interface's timeline semaphore. `semaphore_file` is an opaque file descriptor, which the result then
// owns. Returns null if the device is no GPU. Throws Error(Device).
std::unique_ptr<HandOver> makeHandOver(const DeviceId& device, int semaphore_file);

} // namespace gsc
