// SPDX-License-Identifier: Apache-2.0
// Members of a zip archive in memory, stored or deflated.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <unordered_map>
#include <vector>

struct zip; // libzip's, whose header stays in zip_archive.cpp
struct zip_stat;

namespace gsc {

// Names come from the central directory, sizes too: the local headers of PyTorch's archives hold zeros.
class ZipArchive {
public:
    // `bytes` must outlive the archive; `name` is used in messages only. Throws Error(InvalidFile).
    ZipArchive(std::span<const std::byte> bytes, const std::string& name);

    // In the order of the central directory; no name occurs twice.
    [[nodiscard]] const std::vector<std::string>& members() const { return m_members; }
    [[nodiscard]] bool contains(const std::string& member) const;

    // Bytes of its content as the central directory states them. Throws Error(InvalidFile) if absent.
    [[nodiscard]] uint64_t size(const std::string& member) const;

    // Bytes of all members together.
    [[nodiscard]] uint64_t contentBytes() const;

    // The content, its CRC-32 checked. Throws Error: InvalidFile (absent, damaged, larger than it can be), Unsupported
    // (encrypted, or compressed by anything but deflate, which PyTorch reads too).
    [[nodiscard]] std::vector<std::byte> read(const std::string& member) const;

private:
    [[noreturn]] void invalid(const std::string& text) const;
    [[nodiscard]] zip_stat stat(const std::string& member) const;

    std::span<const std::byte> m_bytes;
    std::string m_name;
    std::unique_ptr<zip, void (*)(zip*)> m_zip;
    std::unordered_map<std::string, uint64_t> m_index;
    std::vector<std::string> m_members;
};

} // namespace gsc
