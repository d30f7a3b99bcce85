// SPDX-License-Identifier: Apache-2.0
// Writes zip archives, laid out as PyTorch's own writer does.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace gsc {

// Members are stored without compression, with data descriptors (sizes and CRC in the local headers are zero), on
// 64-byte boundaries made by an extra field FB, with zero dates, and with ZIP64 end records beside the classic one. The
// archive can have at most 2^32 - 1 bytes.
class ZipWriter {
public:
    explicit ZipWriter(std::string folder) : m_folder(std::move(folder)) {}

    // adds a member under the path <folder>/<member>
    void add(const std::string& member, std::span<const std::byte> content);
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
