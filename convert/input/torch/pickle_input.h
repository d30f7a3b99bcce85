// SPDX-License-Identifier: Apache-2.0
// Bounds-checked access to the bytes of a pickle, and its two kinds of complaint.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

namespace gsc {

class PickleInput {
public:
    // `bytes` and `name` must outlive it; `name` is used in messages only.
    PickleInput(std::span<const std::byte> bytes, const std::string& name) : m_bytes(bytes), m_name(name) {}

    // Error(InvalidFile) and Error(Unsupported) at the opcode that was taken last.
    [[noreturn]] void invalid(const std::string& text) const;
    [[noreturn]] void unsupported(const std::string& what) const;

    void limitSize(size_t max_bytes) const;
    uint8_t takeOpcode();
    std::span<const std::byte> take(size_t count);
    uint64_t takeUnsigned(size_t count); // little-endian, at most 8 bytes
    std::string takeText(size_t count);
    std::string takeLine(size_t max_characters); // up to a line feed, which is dropped

private:
    std::span<const std::byte> m_bytes;
    const std::string& m_name;
    size_t m_cursor = 0;
    size_t m_at = 0; // of the opcode being executed
};

} // namespace gsc
