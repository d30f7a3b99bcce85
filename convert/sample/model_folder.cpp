// SPDX-License-Identifier: Apache-2.0
#include "convert/sample/model_folder.h"

#include "format/error.h"
#include "format/file/output_paths.h"

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <system_error>

#include <fcntl.h>
#include <unistd.h>

namespace gsc {

namespace fs = std::filesystem;

namespace {

bool isModelFolder(const fs::path& path)
{
    return fs::is_directory(path) &&
           (fs::is_empty(path) || fs::exists(path / "cfg_args") || fs::exists(path / "point_cloud"));
}

// All that a sample or a city has in its folder. What else lies there is somebody's work: a .gsc, renderings, notes.
constexpr const char* kOwnNames[] = {"cameras.json", "cfg_args", "paths", "point_cloud"};

// The first by name of what -w would delete and this program never wrote, empty if there is none.
std::string foreignEntry(const fs::path& folder)
{
    std::string first;
    for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
        const std::string name = entry.path().filename().string();
        const bool own = std::find(std::begin(kOwnNames), std::end(kOwnNames), name) != std::end(kOwnNames);
        if (!own && (first.empty() || name < first))
            first = name;
    }
    return first;
}

} // namespace

ModelFolder::ModelFolder(const std::string& path, bool overwrite)
{
    if (path.empty())
        throw Error(ErrorCode::Usage, "output: no folder given, expected a path for the new model; give one");
    checkOutputFolder(path, true);
    m_final = resolveOutput(path);
    std::error_code error;
    if (fs::exists(m_final, error)) {
        if (!overwrite)
            throw Error(
                ErrorCode::Usage,
                path + ": exists already, expected no such folder; choose another folder or pass -w to replace it");
        if (!isModelFolder(m_final))
            throw Error(ErrorCode::Usage, path + ": is not a model folder (no cfg_args, no point_cloud), expected one "
                                                 "for -w to replace; choose another folder");
        if (const std::string name = foreignEntry(m_final); !name.empty())
            throw Error(ErrorCode::Usage, path + ": holds " + name +
                                              ", which -w would delete, expected a folder made by gsc sample; move it "
                                              "away or choose another folder");
    }
    fs::create_directories(m_final.parent_path(), error); // what fails shows in the next line
    m_work.emplace(m_final.string(), TemporaryKind::Folder, 0777);
}

std::string ModelFolder::file(const std::string& relative) const
{
    const fs::path path = fs::path(m_work->path()) / relative;
    std::error_code error;
    fs::create_directories(path.parent_path(), error);
    if (error)
        failOutput(path.parent_path().string(), "cannot be written", error.value());
    return path.string();
}

void ModelFolder::append(const std::string& relative, std::span<const std::byte> bytes) const
{
    const std::string path = file(relative);
    std::ofstream out(path, std::ios::binary | std::ios::app);
    out.write(reinterpret_cast<const char*>(bytes.data()), std::streamsize(bytes.size()));
    out.close();
    if (!out)
        failOutput(path, "cannot be written", errno);
}

void ModelFolder::commit()
{
    const std::string& work = m_work->path();
    // at once where the system can; the old model then has the temporary's name and goes with it
    if (::renameat2(AT_FDCWD, work.c_str(), AT_FDCWD, m_final.c_str(), RENAME_EXCHANGE) == 0) {
        m_work.reset();
        return;
    }
    std::error_code error, ignored;
    const fs::path old = work + ".old"; // no temporary: nobody removes it if this process is killed now
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
    if (replaces)
        fs::remove_all(old, ignored);
}

} // namespace gsc
