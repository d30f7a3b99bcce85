// SPDX-License-Identifier: Apache-2.0
// Device memory for the tests of single stages: poisoned before, guarded on both sides.
#pragma once

#include "kernels/cuda/cuda_check.h"
#include "runtime/cuda/device/cuda_device.h"

#include <algorithm>
#include <cstddef>
#include <string>
#include <type_traits>
#include <vector>

namespace gsc::test {

// The stream all stage tests launch on.
inline const CudaStream& testStream()
{
    static const CudaStream stream;
    return stream;
}

// `count` values of T, all bits set until written: a NaN as a float, and as an index nothing any buffer holds. The
// guards start right beside them, and a byte written there shows in intact().
template <typename T>
class GuardedBuffer {
    static_assert(std::is_trivially_copyable_v<T>);

public:
    explicit GuardedBuffer(size_t count) : m_count(count)
    {
        GSC_CUDA_CHECK(cudaMalloc(reinterpret_cast<void**>(&m_base), bytes() + 2 * kGuard));
        std::string content(kGuard, char(kCanary));
        content.append(bytes(), char(0xff));
        content.append(kGuard, char(kCanary));
        copyIn(m_base, content.data(), content.size());
    }
    explicit GuardedBuffer(const std::vector<T>& values) : GuardedBuffer(values.size()) { write(values); }
    GuardedBuffer(const GuardedBuffer&) = delete;
    GuardedBuffer& operator=(const GuardedBuffer&) = delete;
    ~GuardedBuffer() { cudaFree(m_base); }

    [[nodiscard]] T* get() const { return reinterpret_cast<T*>(m_base + kGuard); }
    [[nodiscard]] size_t count() const { return m_count; }

    // Precondition: no more values than there is room for.
    void write(const std::vector<T>& values) { copyIn(get(), values.data(), values.size() * sizeof(T)); }

    // Waits for all launches before it, as intact() does.
    [[nodiscard]] std::vector<T> read() const
    {
        std::vector<T> values(m_count);
        copyOut(values.data(), get(), bytes());
        return values;
    }

    [[nodiscard]] bool intact() const
    {
        std::vector<unsigned char> before(kGuard), after(kGuard);
        copyOut(before.data(), m_base, kGuard);
        copyOut(after.data(), m_base + kGuard + bytes(), kGuard);
        const auto whole = [](const std::vector<unsigned char>& guard) {
            return std::all_of(guard.begin(), guard.end(), [](unsigned char byte) { return byte == kCanary; });
        };
        return whole(before) && whole(after);
    }

private:
    static constexpr size_t kGuard = 256; // as aligned as what cudaMalloc returns
    static constexpr unsigned char kCanary = 0xa5;

    [[nodiscard]] size_t bytes() const { return m_count * sizeof(T); }

    static void copyIn(void* to, const void* from, size_t size)
    {
        if (size != 0)
            GSC_CUDA_CHECK(cudaMemcpyAsync(to, from, size, cudaMemcpyHostToDevice, testStream().handle));
        GSC_CUDA_CHECK(cudaStreamSynchronize(testStream().handle)); // `from` may go
    }
    static void copyOut(void* to, const void* from, size_t size)
    {
        if (size != 0)
            GSC_CUDA_CHECK(cudaMemcpyAsync(to, from, size, cudaMemcpyDeviceToHost, testStream().handle));
        GSC_CUDA_CHECK(cudaStreamSynchronize(testStream().handle));
    }

    size_t m_count;
    unsigned char* m_base = nullptr;
};

} // namespace gsc::test
