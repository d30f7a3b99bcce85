// SPDX-License-Identifier: Apache-2.0
// Writes a folder of files that appears under its name whole or not at all.
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

// Tells by a folder's entries whether a program of ours made it, so that it may be replaced.
struct FolderKind {
    const char* what;     // name of this kind of folder for messages, such as "model folder"
    const char* made_by;  // the command that makes such folders
    const char* marks[2]; // names of files that only this kind of folder has, one is enough; the second may be nullptr
    // returns true if replacing may delete the entry; a folder with any other entry is not replaced
    bool (*is_own)(const std::filesystem::path& entry);
};

// A new folder. Files are written to a temporary folder beside the target; commit() gives that the target's name.
// Without commit() the destructor removes the temporary, and those parent folders that were made for it.
class NewFolder {
public:
    // Makes the temporary folder. Throws Error: Usage if the folder `path` exists and is not empty, and `overwrite` is
    // false, or it is of another kind, or it holds files of others; Io.
    NewFolder(const std::string& path, bool overwrite, const FolderKind& kind);
    ~NewFolder();
    NewFolder(const NewFolder&) = delete;
    NewFolder& operator=(const NewFolder&) = delete;

    // path in the temporary folder, for a file that the caller writes; creates the folders above it
    [[nodiscard]] std::string file(const std::string& relative) const;
    // Appends `bytes` to a file of the folder, which is created if it is new. Throws Error(Io).
    void append(const std::string& relative, std::span<const std::byte> bytes) const;
    void append(const std::string& relative, std::string_view text) const
    {
        append(relative, std::as_bytes(std::span(text)));
    }
    void commit();

private:
    void removeParents() const;

    std::filesystem::path m_final;                // path of the target, symbolic links followed
    std::vector<std::filesystem::path> m_parents; // parent folders that this object created, innermost first
    std::optional<Temporary> m_work;
};

} // namespace gsc
