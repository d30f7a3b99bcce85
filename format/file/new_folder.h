// SPDX-License-Identifier: Apache-2.0
// A folder of files that appears whole or not at all.
#pragma once

#include "format/file/temporary.h"

#include <cstddef>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace gsc {

// Marks and entries by which a folder is known as one of ours, which may be replaced.
struct FolderKind {
    const char* what;     // "model folder", for messages
    const char* made_by;  // the command that makes such folders
    const char* marks[2]; // names of files, one of which shows the kind; the second may be nullptr
    bool (*is_own)(const std::filesystem::path& entry); // other entries belong to somebody else and are kept
};

// Work is done in a temporary folder beside it; commit() renames that. Unless committed, the destructor removes it, and
// the folders above it that were made for it.
class NewFolder {
public:
    // Throws Error: Usage (the folder exists, is not empty and `overwrite` is off, or it is of another kind, or holds
    // other files), Io.
    NewFolder(const std::string& path, bool overwrite, const FolderKind& kind);
    ~NewFolder();
    NewFolder(const NewFolder&) = delete;
    NewFolder& operator=(const NewFolder&) = delete;

    [[nodiscard]] std::string file(const std::string& relative) const; // creates the folders above it
    // Appends to the file; a new one starts empty. Throws Error(Io).
    void append(const std::string& relative, std::span<const std::byte> bytes) const;
    void append(const std::string& relative, std::string_view text) const
    {
        append(relative, std::as_bytes(std::span(text)));
    }
    void commit();

private:
    void removeParents() const;

    std::filesystem::path m_final;                // links followed
    std::vector<std::filesystem::path> m_parents; // folders that this created, innermost first
    std::optional<Temporary> m_work;
};

} // namespace gsc
