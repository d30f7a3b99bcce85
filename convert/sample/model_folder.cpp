// SPDX-License-Identifier: Apache-2.0
#include "convert/sample/model_folder.h"

#include "format/error.h"

#include <cerrno>
#include <cstring>
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

fs::path sibling(const fs::path& path, const char* what)
{
    return path.parent_path() / formatString(".%s.%s-%d", path.filename().c_str(), what, int(::getpid()));
}

[[noreturn]] void throwIo(const std::string& path, const std::error_code& error)
{
    throw Error(ErrorCode::Io, path + ": " + error.message());
}

} // namespace

ModelFolder::ModelFolder(const std::string& path, bool overwrite)
{
    if (path.empty())
        throw Error(ErrorCode::Usage, "output: no folder given, expected a path for the new model");
    std::error_code error;
    m_final = fs::absolute(path, error).lexically_normal();
    if (m_final.filename().empty()) // a path that ends in a slash
        m_final = m_final.parent_path();
    if (fs::exists(fs::symlink_status(m_final, error))) {
        if (!overwrite)
            throw Error(ErrorCode::Usage, path + ": exists already; choose another folder or pass -w to replace it");
        if (!isModelFolder(m_final))
            throw Error(ErrorCode::Usage, path + ": is not a model folder (no cfg_args, no point_cloud), "
                                                 "which -w would replace; choose another folder");
    }
    m_work = sibling(m_final, "part");
    fs::remove_all(m_work, error); // of a process with the same number that was killed
    fs::create_directories(m_work, error);
    if (error)
        throwIo(m_work.string(), error);
}

ModelFolder::~ModelFolder()
{
    std::error_code error;
    if (!m_work.empty())
        fs::remove_all(m_work, error);
}

std::string ModelFolder::file(const std::string& relative) const
{
    const fs::path path = m_work / relative;
    std::error_code error;
    fs::create_directories(path.parent_path(), error);
    if (error)
        throwIo(path.parent_path().string(), error);
    return path.string();
}

void ModelFolder::commit()
{
    std::error_code error;
    const fs::path old = sibling(m_final, "old");
    const bool replaces = fs::exists(m_final, error);
    if (replaces) {
        fs::rename(m_final, old, error);
        if (error)
            throwIo(m_final.string(), error);
    }
    fs::rename(m_work, m_final, error);
    if (error) {
        std::error_code ignored;
        if (replaces)
            fs::rename(old, m_final, ignored);
        throwIo(m_final.string(), error);
    }
    m_work.clear();
    if (replaces)
        fs::remove_all(old, error);
}

FileStream::FileStream(const std::string& path) : m_path(path)
{
    m_file = ::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
    if (m_file < 0)
        throwIo(path, {errno, std::generic_category()});
}

FileStream::~FileStream()
{
    if (m_file >= 0)
        ::close(m_file);
}

void FileStream::write(const void* data, size_t bytes)
{
    const char* next = static_cast<const char*>(data);
    m_bytes += bytes;
    while (bytes > 0) {
        const ssize_t written = ::write(m_file, next, bytes);
        if (written < 0 && errno == EINTR)
            continue;
        if (written < 0)
            throwIo(m_path, {errno, std::generic_category()});
        next += written;
        bytes -= size_t(written);
    }
}

void FileStream::close()
{
    const int file = m_file;
    m_file = -1;
    if (::close(file) != 0)
        throwIo(m_path, {errno, std::generic_category()});
}

void writeFile(const std::string& path, std::span<const std::byte> bytes)
{
    FileStream file(path);
    file.write(bytes.data(), bytes.size());
    file.close();
}

void writeFile(const std::string& path, std::string_view text)
{
    writeFile(path, std::as_bytes(std::span(text)));
}

} // namespace gsc
