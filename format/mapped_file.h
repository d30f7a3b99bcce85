// SPDX-License-Identifier: Apache-2.0
// A whole file, mapped for reading. All mapping code of the project.
#pragma once

#include <cstddef>
#include <span>
#include <string>

namespace gsc {

class MappedFile {
public:
    // Throws Error(Io) if `path` cannot be opened, is not a regular file or cannot be mapped. An empty file is fine.
    explicit MappedFile(const std::string& path);
    ~MappedFile();
    MappedFile(MappedFile&& other) noexcept;
    MappedFile& operator=(MappedFile&& other) noexcept;

    // Page-aligned; valid as long as this object lives.
    // note: a file that another process shortens while it is mapped raises SIGBUS on access, as with every mapping
    [[nodiscard]] std::span<const std::byte> bytes() const noexcept { return {m_data, m_size}; }

private:
    const std::byte* m_data = nullptr;
    size_t m_size = 0;
};

} // namespace gsc
