// SPDX-License-Identifier: Apache-2.0
// Maps a whole file for reading. No other code of the project maps files.
#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <string>

namespace gsc {

// Messages about a mapping that cannot be read any more, one per form of output, each with its line end.
struct FaultTexts {
    std::string text;  // plain text for people
    std::string event; // JSON as in schemas/progress-event.schema.json
    std::string json;  // JSON as in schemas/error.schema.json
};

class MappedFile {
public:
    // Maps the file. Throws Error: Io if `path` cannot be opened, is not a regular file or cannot be mapped;
    // OutOfMemory if there is no address space for it. An empty file is allowed.
    explicit MappedFile(const std::string& path);
    ~MappedFile();
    MappedFile(MappedFile&& other) noexcept;
    MappedFile& operator=(MappedFile&& other) noexcept;

    // Bytes of the file, from an address aligned to a page; valid as long as this object lives. note: a file that
    // another process shortens while it is mapped raises SIGBUS when it is read; see file_fault.h
    [[nodiscard]] std::span<const std::byte> bytes() const noexcept { return {m_data, m_size}; }

private:
    const std::byte* m_data = nullptr;
    size_t m_size = 0;
    int m_slot = -1; // index in the table that faultTextsOf() searches, -1: none
    std::unique_ptr<const FaultTexts> m_texts;
};

// Messages of the mapped file that `address` lies in; null if it lies in none. Async-signal-safe.
const FaultTexts* faultTextsOf(const void* address) noexcept;

} // namespace gsc
