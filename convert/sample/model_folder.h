// SPDX-License-Identifier: Apache-2.0
// A model folder that appears whole or not at all.
#pragma once

#include "format/file/temporary.h"

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace gsc {

// Work goes on in a temporary folder beside it; commit() renames that. Unless committed, the destructor removes it.
class ModelFolder {
public:
    // Throws Error: Usage (the folder exists and `overwrite` is off, or holds anything that no
    // sample has), Io.
    ModelFolder(const std::string& path, bool overwrite);
    ModelFolder(const ModelFolder&) = delete;
    ModelFolder& operator=(const ModelFolder&) = delete;

    [[nodiscard]] std::string file(const std::string& relative) const; // creates the folders above it
    void commit();

private:
    std::filesystem::path m_final; // links followed
    std::optional<Temporary> m_work;
};

// Throws Error(Io).
void writeFile(const std::string& path, std::span<const std::byte> bytes);
void writeFile(const std::string& path, std::string_view text);

// A file written from front to back.
class FileStream {
public:
    explicit FileStream(const std::string& path); // throws Error(Io)
    FileStream(const FileStream&) = delete;
    FileStream& operator=(const FileStream&) = delete;
    ~FileStream();

    void write(const void* data, size_t bytes); // throws Error(Io)
    void close();                               // throws Error(Io)
    [[nodiscard]] uint64_t bytes() const { return m_bytes; }

private:
    std::string m_path;
    int m_file = -1;
    uint64_t m_bytes = 0;
};

} // namespace gsc
