// SPDX-License-Identifier: Apache-2.0
// A zip archive laid out as PyTorch's own writer does it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace gsc {

// Stored members with data descriptors (sizes and CRC in the local headers are zero), payloads on 64-byte boundaries
// through an extra field 'FB', all dates zero, ZIP64 end records beside the classic one. At most 2^32 - 1 bytes.
class ZipWriter {
public:
    explicit ZipWriter(std::string folder) : m_folder(std::move(folder)) {}

    void add(const std::string& member, std::span<const std::byte> content); // adds <folder>/<member>
    void add(const std::string& member, const std::string& content);
    [[nodiscard]] std::vector<std::byte> finish();

private:
    struct Entry {
        std::string name;
        uint32_t crc, size, offset;
    };

    std::string m_folder;
    std::vector<std::byte> m_bytes;
    std::vector<Entry> m_entries;
};

} // namespace gsc
