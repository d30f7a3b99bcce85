// SPDX-License-Identifier: Apache-2.0
// Bounds-checked access to bytes that come from outside the program, such as those of a file.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <span>
#include <type_traits>

namespace gsc {

class ByteView {
public:
    ByteView() = default;
    explicit ByteView(std::span<const std::byte> bytes) : m_bytes(bytes) {}

    [[nodiscard]] uint64_t size() const noexcept { return m_bytes.size(); }
    [[nodiscard]] std::span<const std::byte> bytes() const noexcept { return m_bytes; }

    // note: offset + count is never computed, because the sum could wrap around
    [[nodiscard]] bool contains(uint64_t offset, uint64_t count) const noexcept
    {
        return offset <= m_bytes.size() && count <= m_bytes.size() - offset;
    }

    [[nodiscard]] std::optional<std::span<const std::byte>> slice(uint64_t offset, uint64_t count) const noexcept
    {
        if (!contains(offset, count))
            return std::nullopt;
        return m_bytes.subspan(size_t(offset), size_t(count));
    }

    // Returns a copy of the T at `offset`, which need not be aligned; nullopt if the T does not lie inside.
    template <typename T>
    [[nodiscard]] std::optional<T> load(uint64_t offset) const noexcept
    {
        static_assert(std::is_trivially_copyable_v<T>);
        if (!contains(offset, sizeof(T)))
            return std::nullopt;
        T value;
        std::memcpy(&value, m_bytes.data() + offset, sizeof(T));
        return value;
    }

    // Returns `count` records of T in place; nullopt if they do not lie inside, or the first is not aligned for T.
    template <typename T>
    [[nodiscard]] std::optional<std::span<const T>> array(uint64_t offset, uint64_t count) const noexcept
    {
        static_assert(std::is_trivially_copyable_v<T>);
        if (offset > m_bytes.size() || count > (m_bytes.size() - offset) / sizeof(T))
            return std::nullopt;
        const std::byte* const first = m_bytes.data() + offset;
        if (reinterpret_cast<uintptr_t>(first) % alignof(T) != 0)
            return std::nullopt;
        return std::span<const T>(reinterpret_cast<const T*>(first), size_t(count));
    }

private:
    std::span<const std::byte> m_bytes;
};

} // namespace gsc
