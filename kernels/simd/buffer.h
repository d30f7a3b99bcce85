// SPDX-License-Identifier: Apache-2.0
// Memory that is kept from frame to frame: it grows but never shrinks, and loses its content when it grows.
#pragma once

#include <gsc/error.h>

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <type_traits>

namespace gsc {

struct FreeMemory {
    void operator()(void* p) const { std::free(p); }
};

template <typename T>
class Buffer {
    static_assert(std::is_trivially_copyable_v<T>);

public:
    // Makes data() hold at least `count` values, whose content is undefined if the buffer grew. Throws
    // Error(OutOfMemory).
    void reserve(size_t count)
    {
        if (count <= m_capacity)
            return;
        reserveExactly(count + count / 4);
    }

    // Makes data() hold `wanted` values, as reserve() does, but without extra room for growth.
    void reserveExactly(size_t wanted)
    {
        if (wanted <= m_capacity)
            return;
        if (wanted > SIZE_MAX / 2 / sizeof(T))
            throwOutOfMemory(wanted);
        m_data.reset();
        m_capacity = 0;
        m_data.reset(static_cast<T*>(std::aligned_alloc(kAlignment, roundUp(wanted * sizeof(T)))));
        if (m_data == nullptr)
            throwOutOfMemory(wanted);
        m_capacity = wanted;
    }

    [[nodiscard]] T* data() { return m_data.get(); }
    [[nodiscard]] const T* data() const { return m_data.get(); }
    [[nodiscard]] T& operator[](size_t i) { return m_data.get()[i]; }
    [[nodiscard]] const T& operator[](size_t i) const { return m_data.get()[i]; }
    [[nodiscard]] size_t capacity() const { return m_capacity; }
    [[nodiscard]] uint64_t bytes() const { return m_capacity * sizeof(T); }

private:
    static constexpr size_t kAlignment = 64; // bytes of a cache line and of an AVX-512 vector

    static size_t roundUp(size_t bytes) { return (bytes + kAlignment - 1) / kAlignment * kAlignment; }

    [[noreturn]] static void throwOutOfMemory(size_t count)
    {
        throw Error(ErrorCode::OutOfMemory, "frame buffer",
                    formatString("no memory for %zu values of %zu bytes", count, sizeof(T)), "enough for this view",
                    "render smaller images or a smaller model");
    }

    std::unique_ptr<T, FreeMemory> m_data;
    size_t m_capacity = 0;
};

} // namespace gsc
