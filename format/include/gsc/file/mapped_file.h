// SPDX-License-Identifier: Apache-2.0
// A whole file, mapped for reading. All mapping code of the project.
#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <string>

namespace gsc {

// Messages for a mapping that cannot be read any more, one per way of output, each with its line end.
struct FaultTexts {
    std::string text;  // message for people
    std::string event; // schemas/progress-event.schema.json
    std::string json;  // schemas/error.schema.json
};

class MappedFile {
public:
    // Throws Error: Io if `path` cannot be opened, is not a regular file or cannot be mapped, OutOfMemory if there is no
    // address space for it. An empty file is fine.
    explicit MappedFile(const std::string& path);
    ~MappedFile();
    MappedFile(MappedFile&& other) noexcept;
    MappedFile& operator=(MappedFile&& other) noexcept;

    // Page-aligned; valid as long as this object lives.
    // note: a file that another process shortens while it is mapped raises SIGBUS on access, as with every mapping; what
    // a program does then: file_fault.h
    [[nodiscard]] std::span<const std::byte> bytes() const noexcept { return {m_data, m_size}; }

private:
    const std::byte* m_data = nullptr;
    size_t m_size = 0;
    int m_slot = -1; // in the table of faultTextsOf()
    std::unique_ptr<const FaultTexts> m_texts;
};

// The mapped file that `address` lies in, null if there is none. Async-signal-safe.
const FaultTexts* faultTextsOf(const void* address) noexcept;

} // namespace gsc
