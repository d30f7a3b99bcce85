// SPDX-License-Identifier: Apache-2.0
// Pictures of a GPU, handed over to a program interface that has memory and semaphores of its own on it, such as Vulkan.
// Nothing here names a CUDA header.
#pragma once

#include <gsc/device.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>

namespace gsc {

// UUID by which CUDA and Vulkan know a GPU; none of another device, or without CUDA.
std::optional<std::array<unsigned char, 16>> deviceUuid(const DeviceId& device);

// From one thread at a time. All throw Error(Device).
class HandOver {
public:
    virtual ~HandOver() = default; // waits for its copies; frees its view of the blocks

    // Memory of the other side as an opaque file descriptor, which is this one's from now on.
    virtual void addBlock(uint32_t id, int file, size_t bytes) = 0;
    virtual void dropBlock(uint32_t id) = 0; // waits for copies to it

    // Begins to copy. `from`: memory of the device whose content is there; it must not change until signal() of a value
    // after this has been waited for.
    virtual void copy(uint32_t id, size_t offset, const void* from, size_t bytes) = 0;
    // Sets the other side's timeline semaphore when every copy before is done; values rise.
    virtual void signal(uint64_t value) = 0;
};

// Takes the other side's timeline semaphore as an opaque file descriptor, which it then owns. Returns null if the
// device is no GPU. Throws Error(Device).
std::unique_ptr<HandOver> makeHandOver(const DeviceId& device, int semaphore_file);

} // namespace gsc
