// SPDX-License-Identifier: Apache-2.0
// Reads members of a zip archive that is in memory, stored or deflated.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <unordered_map>
#include <vector>

struct zip; // type of libzip, whose header only zip_archive.cpp includes
struct zip_stat;

namespace gsc {

// Reads a zip archive. Names and sizes come from the central directory, because the local headers of PyTorch's archives
// hold zeros.
class ZipArchive {
public:
    // Opens the archive in `bytes`, which must outlive this. `name` is used in messages only. Throws
    // Error(InvalidFile).
    ZipArchive(std::span<const std::byte> bytes, const std::string& name);

    // Names of the members in the order of the central directory; no name occurs twice.
    [[nodiscard]] const std::vector<std::string>& members() const { return m_members; }
    [[nodiscard]] bool contains(const std::string& member) const;

    // Size in bytes of the unpacked member, as the central directory states it. Throws Error(InvalidFile) if there is
    // no such member.
    [[nodiscard]] uint64_t size(const std::string& member) const;

    // Size in bytes of all unpacked members together.
    [[nodiscard]] uint64_t contentBytes() const;

    // Unpacked bytes of a member, with the CRC-32 checked. Throws Error: InvalidFile (no such member, damaged, larger
    // than possible), Unsupported (encrypted, or compressed by another method than deflate; PyTorch reads no other
    // either).
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
