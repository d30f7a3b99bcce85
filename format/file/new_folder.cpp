// SPDX-License-Identifier: Apache-2.0
#include "format/file/new_folder.h"

#include <gsc/error.h>
#include <gsc/file/output_paths.h>

#include <cerrno>
#include <cstdio>
#include <fstream>
#include <system_error>

#include <fcntl.h>
#include <unistd.h>

namespace gsc {

namespace fs = std::filesystem;

namespace {

// First, by name, of the folder's entries that do not belong to this kind of folder, which replacing would delete;
// empty if there is none.
std::string foreignEntry(const fs::path& folder, const FolderKind& kind)
{
    std::string first;
    for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
        const std::string name = entry.path().filename().string();
        if (!kind.is_own(entry.path()) && (first.empty() || name < first))
            first = name;
    }
    return first;
}

// Checks a folder that exists; throws Error(Usage) unless it may be replaced.
void checkReplaced(const std::string& path, const fs::path& folder, const FolderKind& kind)
{
    const char* const other = kind.marks[1] == nullptr ? kind.marks[0] : kind.marks[1];
    if (!fs::is_directory(folder) || (!fs::exists(folder / kind.marks[0]) && !fs::exists(folder / other)))
        throw Error(ErrorCode::Usage, path,
                    formatString("is not a %s (no %s%s%s)", kind.what, kind.marks[0],
                                 other == kind.marks[0] ? "" : ", no ", other == kind.marks[0] ? "" : other),
                    "one to replace", "choose another folder");
    if (const std::string name = foreignEntry(folder, kind); !name.empty())
        throw Error(ErrorCode::Usage, path, "holds " + name + ", which would be deleted",
                    std::string("a folder made by ") + kind.made_by, "move it away or choose another folder");
}

} // namespace

NewFolder::NewFolder(const std::string& path, bool overwrite, const FolderKind& kind)
{
    if (path.empty())
        throw Error(ErrorCode::Usage, "output", "no folder given", std::string("a path for the new ") + kind.what,
                    "give one");
    checkOutputFolder(path, true);
    m_final = resolveOutput(path);
    std::error_code error;
    if (fs::exists(m_final, error) && !(fs::is_directory(m_final) && fs::is_empty(m_final))) {
        if (!overwrite)
            throw Error(ErrorCode::Usage, path, "exists already", "no such folder",
                        "choose another folder or have it replaced")
                .with({Setting::Overwrite});
        checkReplaced(path, m_final, kind);
    }
    for (fs::path parent = m_final.parent_path(); !parent.empty() && !fs::exists(parent, error);
         parent = parent.parent_path())
        m_parents.push_back(parent);
    try {
        // an error shows in the next line, which needs the folder
        fs::create_directories(m_final.parent_path(), error);
        m_work.emplace(m_final.string(), TemporaryKind::Folder, 0777);
    } catch (...) {
        removeParents();
        throw;
    }
}

NewFolder::~NewFolder()
{
    m_work.reset();
    removeParents();
}

void NewFolder::removeParents() const
{
    for (const fs::path& parent : m_parents)
        ::rmdir(parent.c_str()); // refuses a folder that is not empty
}

std::string NewFolder::file(const std::string& relative) const
{
    const fs::path path = fs::path(m_work->path()) / relative;
    std::error_code error;
    fs::create_directories(path.parent_path(), error);
    if (error)
        failOutput(path.parent_path().string(), "cannot be written", error.value());
    return path.string();
}

void NewFolder::append(const std::string& relative, std::span<const std::byte> bytes) const
{
    const std::string path = file(relative);
    std::ofstream out(path, std::ios::binary | std::ios::app);
    out.write(reinterpret_cast<const char*>(bytes.data()), std::streamsize(bytes.size()));
    out.close();
    if (!out)
        failOutput(path, "cannot be written", errno);
}

void NewFolder::commit()
{
    const std::string& work = m_work->path();
    // exchanges the old and the new folder in one step if the system can; the old one then has the temporary's name,
    // under which it is removed
    if (::renameat2(AT_FDCWD, work.c_str(), AT_FDCWD, m_final.c_str(), RENAME_EXCHANGE) == 0) {
        m_work.reset();
        m_parents.clear();
        return;
    }
    std::error_code error, ignored;
    // not registered as a temporary: if this process is killed now, the user's old folder stays
    const fs::path old = work + ".old";
    const bool replaces = fs::exists(m_final, ignored);
    if (replaces)
        fs::rename(m_final, old, error);
    if (!error)
        fs::rename(work, m_final, error);
    if (error) {
        if (replaces && !fs::exists(m_final, ignored))
            fs::rename(old, m_final, ignored);
        failOutput(m_final.string(), "cannot be written", error.value());
    }
    m_work->release();
    m_parents.clear();
    if (replaces)
        fs::remove_all(old, ignored);
}

} // namespace gsc
