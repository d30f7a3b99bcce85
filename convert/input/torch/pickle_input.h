// SPDX-License-Identifier: Apache-2.0
// Reads the bytes of a pickle with checks of its bounds, and throws its errors.
#pragma once

#include <gsc/error.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

namespace gsc {

class PickleInput {
public:
    // `bytes` and `name` must outlive this; `name` is used in messages only.
    PickleInput(std::span<const std::byte> bytes, const std::string& name) : m_bytes(bytes), m_name(name) {}

    // These two throw Error(InvalidFile) and Error(Unsupported); the message names the opcode that was read last.
    [[noreturn]] void invalid(const std::string& text) const
    {
        throw Error(ErrorCode::InvalidFile, m_name, formatString("%s at byte %zu of the pickle", text.c_str(), m_at),
                    "what PyTorch writes", "save it again");
    }

    [[noreturn]] void unsupported(const std::string& what) const
    {
        throw Error(ErrorCode::Unsupported, m_name, formatString("pickle holds %s (byte %zu)", what.c_str(), m_at),
                    "only tensors, modules and state dictionaries",
                    "export the state_dict of the MLPs with torch.save");
    }

    void limitSize(size_t max_bytes) const
    {
        if (m_bytes.size() > max_bytes)
            unsupported(formatString("a pickle of %zu bytes, at most %zu are read", m_bytes.size(), max_bytes));
    }

    [[nodiscard]] size_t position() const { return m_cursor; }

    uint8_t takeOpcode()
    {
        m_at = m_cursor;
        return uint8_t(take(1)[0]);
    }

    std::span<const std::byte> take(size_t count)
    {
        if (count > m_bytes.size() - m_cursor)
            invalid("pickle ends too early");
        const auto part = m_bytes.subspan(m_cursor, count);
        m_cursor += count;
        return part;
    }

    // Reads a little-endian integer of `count` bytes, at most 8.
    uint64_t takeUnsigned(size_t count)
    {
        uint64_t value = 0;
        const auto part = take(count);
        for (size_t i = 0; i < count; ++i)
            value |= uint64_t(part[i]) << (8 * i);
        return value;
    }

    std::string takeText(size_t count)
    {
        const auto part = take(count);
        return {reinterpret_cast<const char*>(part.data()), part.size()};
    }

    // Reads the text up to the next line feed, which is skipped. Throws if it is longer than max_characters.
    std::string takeLine(size_t max_characters)
    {
        const auto rest = m_bytes.subspan(m_cursor, std::min(m_bytes.size() - m_cursor, max_characters + 1));
        const auto end = std::find(rest.begin(), rest.end(), std::byte('\n'));
        if (end == rest.end())
            invalid("unterminated or overlong name");
        std::string line = takeText(size_t(end - rest.begin()));
        ++m_cursor;
        return line;
    }

private:
    std::span<const std::byte> m_bytes;
    const std::string& m_name;
    size_t m_cursor = 0;
    size_t m_at = 0; // byte offset of the opcode that is being executed
};

} // namespace gsc
