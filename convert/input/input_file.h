// SPDX-License-Identifier: Apache-2.0
// Reads input files, whole or from any position.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace gsc {

// An open file. Every read states its position, so that several readers can share one object.
class InputFile {
public:
    explicit InputFile(const std::string& path); // throws Error: Io, and as refuseStandIn()
    ~InputFile();
    InputFile(const InputFile&) = delete;
    InputFile& operator=(const InputFile&) = delete;

    [[nodiscard]] const std::string& path() const { return m_path; }
    [[nodiscard]] uint64_t bytes() const { return m_bytes; }

    // Fills `out` with the bytes from `offset` on. Throws Error(Io), also if the file has become shorter.
    void read(uint64_t offset, std::span<std::byte> out) const;
    // Asks the kernel to read the bytes [offset, offset + bytes) ahead, because they are needed next; never fails.
    void prefetch(uint64_t offset, uint64_t bytes) const noexcept;

private:
    void refuseStandIn() const;

    std::string m_path;
    int m_fd = -1;
    uint64_t m_bytes = 0;
};

// Reads a file. Throws Error: as the constructor of InputFile; InvalidFile if the file is larger than `max_bytes`, and
// then the message says that `what` was expected.
std::vector<std::byte> readWholeFile(const std::string& path, uint64_t max_bytes, const char* what);
// Reads a text file, without a byte order mark at its start (decodedText()). Throws as readWholeFile().
std::string readTextFile(const std::string& path, uint64_t max_bytes, const char* what);

} // namespace gsc
