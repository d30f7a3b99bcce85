// SPDX-License-Identifier: Apache-2.0
// Files that are read whole, and positional reads of those that are not.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace gsc {

// An open file. Reads are positional, so that one object can serve several readers.
class InputFile {
public:
    explicit InputFile(const std::string& path); // throws Error: Io, as refuseStandIn()
    ~InputFile();
    InputFile(const InputFile&) = delete;
    InputFile& operator=(const InputFile&) = delete;

    [[nodiscard]] const std::string& path() const { return m_path; }
    [[nodiscard]] uint64_t bytes() const { return m_bytes; }

    // Fills `out` completely. Throws Error(Io), also if the file has become shorter.
    void read(uint64_t offset, std::span<std::byte> out) const;
    // Tells the kernel that [offset, offset + bytes) is wanted next; never fails.
    void prefetch(uint64_t offset, uint64_t bytes) const noexcept;

private:
    void refuseStandIn() const;

    std::string m_path;
    int m_fd = -1;
    uint64_t m_bytes = 0;
};

// Throws Error: as InputFile, InvalidFile if the file is larger than `max_bytes` (`what`: the expected content).
std::vector<std::byte> readWholeFile(const std::string& path, uint64_t max_bytes, const char* what);
// Reads a text, without its byte order mark (decodedText()). Throws as readWholeFile().
std::string readTextFile(const std::string& path, uint64_t max_bytes, const char* what);

} // namespace gsc
