// SPDX-License-Identifier: Apache-2.0
#include "convert/commands/text_file.h"

#include "format/error.h"
#include "format/output_paths.h"

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <memory>
#include <unistd.h>

namespace gsc {

namespace {

struct FileCloser {
    void operator()(std::FILE* file) const { std::fclose(file); }
};
using File = std::unique_ptr<std::FILE, FileCloser>;

[[noreturn]] void throwIo(const std::string& path, const char* what)
{
    throw Error(ErrorCode::Io, formatString("%s: %s (%s), expected a file in a folder that is there and may be used; "
                                            "check the path, its rights and the free space",
                                            path.c_str(), what, std::strerror(errno)));
}

} // namespace

void checkOutputPath(const std::string& path, bool overwrite)
{
    namespace fs = std::filesystem;
    std::error_code ignored;
    const fs::file_status status = fs::status(path, ignored);
    checkRegularOrAbsent(path);
    if (fs::exists(status) && !overwrite)
        throw Error(ErrorCode::Io, path + ": already exists, expected no such file; pass -w to overwrite it");
    const fs::path folder = fs::path(path).parent_path();
    if (!folder.empty() && !fs::is_directory(folder, ignored))
        throw Error(ErrorCode::Io, path + ": its folder does not exist, expected an existing one; create " +
                                       folder.string() + " first");
}

void checkOutputFolder(const std::string& path, bool overwrite)
{
    namespace fs = std::filesystem;
    std::error_code ignored;
    const fs::file_status status = fs::status(path, ignored);
    if (fs::exists(status) && !fs::is_directory(status))
        throw Error(ErrorCode::Io, path + ": is a file, expected the name of a folder to create");
    if (fs::exists(status) && !fs::is_empty(path, ignored) && !overwrite)
        throw Error(ErrorCode::Io,
                    path + ": already exists, expected no such folder; pass -w to replace what is in it");
}

void writeTextFile(const std::string& path, const std::string& text)
{
    const std::string temporary = formatString("%s.%ld.tmp", path.c_str(), long(::getpid()));
    File file(std::fopen(temporary.c_str(), "wxb"));
    if (!file)
        throwIo(temporary, "cannot be created");
    const bool written = std::fwrite(text.data(), 1, text.size(), file.get()) == text.size() &&
                         std::fflush(file.get()) == 0 && ::fsync(::fileno(file.get())) == 0;
    file.reset();
    if (!written || std::rename(temporary.c_str(), path.c_str()) != 0) {
        const int reason = errno;
        std::remove(temporary.c_str());
        errno = reason;
        throwIo(path, "cannot be written");
    }
}

std::string readTextFile(const std::string& path)
{
    const File file(std::fopen(path.c_str(), "rb"));
    if (!file)
        throwIo(path, "cannot be opened");
    std::string text;
    char buffer[65536];
    for (size_t count; (count = std::fread(buffer, 1, sizeof(buffer), file.get())) > 0;)
        text.append(buffer, count);
    if (std::ferror(file.get()))
        throwIo(path, "cannot be read");
    return text;
}

} // namespace gsc
