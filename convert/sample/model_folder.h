// SPDX-License-Identifier: Apache-2.0
// A model folder that appears whole or not at all.
#pragma once

#include "format/file/temporary.h"

#include <cstddef>
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
    // Behind what is in the file; a new one starts empty. Throws Error(Io).
    void append(const std::string& relative, std::span<const std::byte> bytes) const;
    void append(const std::string& relative, std::string_view text) const
    {
        append(relative, std::as_bytes(std::span(text)));
    }
    void commit();

private:
    std::filesystem::path m_final; // links followed
    std::optional<Temporary> m_work;
};

} // namespace gsc
