// SPDX-License-Identifier: Apache-2.0
// Device memory in one piece, and its division into arrays. It can grow, but loses its content then.
#pragma once

#include <gsc/error.h>
#include "kernels/cuda/cuda_check.h"
#include "runtime/cuda/device/arena_room.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>

namespace gsc {

// Bytes of device memory that a backend may hold (`limit`, 0 = all there is) and holds now (`used`).
struct MemoryBudget {
    uint64_t limit = 0, used = 0;
};

class DeviceArena {
public:
    explicit DeviceArena(MemoryBudget& budget) : m_budget(budget) {}
    DeviceArena(const DeviceArena&) = delete;
    DeviceArena& operator=(const DeviceArena&) = delete;
    ~DeviceArena() { release(); }

    // Makes room for `bytes`. If it has to grow, it waits for the device, its content becomes undefined, and it
    // returns true. `what` names it in messages. Throws Error (OutOfMemory, Device).
    bool reserve(size_t bytes, const char* what)
    {
        if (bytes <= m_bytes)
            return false;
        release();
        if (m_budget.limit != 0 && m_budget.used + bytes > m_budget.limit)
            throw Error(ErrorCode::OutOfMemory, "cuda",
                        formatString("%s takes %zu bytes of device memory beside %llu in use", what, bytes,
                                     static_cast<unsigned long long>(m_budget.used)),
                        formatString("at most %llu in all", static_cast<unsigned long long>(m_budget.limit)),
                        "raise the budget of device memory, draw smaller images, or draw on the CPU")
                .with({Setting::DeviceMemory, Setting::ImageSize, Setting::CpuBackend});
        void* data = nullptr;
        const cudaError_t code = cudaMalloc(&data, bytes);
        if (code == cudaErrorMemoryAllocation) {
            (void)cudaGetLastError();
            size_t left = 0, total = 0;
            (void)cudaMemGetInfo(&left, &total);
            throw Error(
                ErrorCode::OutOfMemory, "cuda",
                formatString("%s takes %zu bytes of device memory, of %zu only %zu are free", what, bytes, total, left),
                "enough", "lower the budget of device memory, draw smaller images, or draw on the CPU")
                .with({Setting::DeviceMemory, Setting::ImageSize, Setting::CpuBackend});
        }
        GSC_CUDA_CHECK(code);
        m_data = static_cast<unsigned char*>(data);
        m_bytes = bytes;
        m_budget.used += bytes;
        return true;
    }

    void release()
    {
        cudaFree(m_data);
        m_data = nullptr;
        m_budget.used -= m_bytes;
        m_bytes = 0;
    }

    // Bytes that may still be reserved, if the device has `left` bytes free.
    [[nodiscard]] uint64_t free(uint64_t left) const
    {
        const uint64_t allowed = m_budget.limit - std::min(m_budget.used, m_budget.limit);
        return m_budget.limit == 0 ? left : std::min(left, allowed);
    }

    [[nodiscard]] unsigned char* get() const { return m_data; }
    [[nodiscard]] uint64_t bytes() const { return m_bytes; }

private:
    MemoryBudget& m_budget;
    unsigned char* m_data = nullptr;
    size_t m_bytes = 0;
};

// Divides a block of memory into arrays, one behind the other. Without memory it only counts bytes: lay out twice,
// first to know the size.
class ArenaLayout {
public:
    explicit ArenaLayout(unsigned char* base) : m_base(base) {}

    // Returns memory for `count` values, aligned for any load; null while bytes are counted.
    template <typename T>
    T* take(size_t count)
    {
        T* const at = m_base == nullptr ? nullptr : reinterpret_cast<T*>(m_base + m_bytes);
        m_bytes += arenaRoom(at, std::max<size_t>(count, 1) * sizeof(T));
        return at;
    }

    [[nodiscard]] size_t bytes() const { return m_bytes; }

private:
    unsigned char* m_base;
    size_t m_bytes = 0;
};

// Makes room in `arena` for the arrays that layOut(ArenaLayout&) takes, lets it take them there, and returns its
// result. Throws as reserve() does.
template <typename LayOut>
auto layOutIn(DeviceArena& arena, const char* what, const LayOut& layOut)
{
    ArenaLayout counted(nullptr);
    layOut(counted);
    arena.reserve(counted.bytes(), what);
    ArenaLayout layout(arena.get());
    return layOut(layout);
}

} // namespace gsc
