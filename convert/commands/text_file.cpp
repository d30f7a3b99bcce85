// SPDX-License-Identifier: Apache-2.0
#include "convert/commands/text_file.h"

#include "format/error.h"

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>

namespace gsc {

namespace {

struct FileCloser {
    void operator()(std::FILE* file) const { std::fclose(file); }
};
using File = std::unique_ptr<std::FILE, FileCloser>;

[[noreturn]] void throwIo(const std::string& path, const char* what)
{
    throw Error(ErrorCode::Io, formatString("%s: %s (%s), expected a text file; check its path and rights",
                                            path.c_str(), what, std::strerror(errno)));
}

} // namespace

std::string readTextFile(const std::string& path)
{
    const File opened(path == "-" ? nullptr : std::fopen(path.c_str(), "rb"));
    std::FILE* const file = path == "-" ? stdin : opened.get();
    if (!file)
        throwIo(path, "cannot be opened");
    std::string text;
    char buffer[65536];
    for (size_t count; (count = std::fread(buffer, 1, sizeof(buffer), file)) > 0;)
        text.append(buffer, count);
    if (std::ferror(file))
        throwIo(path, "cannot be read");
    return text;
}

} // namespace gsc
