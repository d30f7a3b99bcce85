// SPDX-License-Identifier: Apache-2.0
#include "format/output_paths.h"

#include "format/error.h"

#include <filesystem>
#include <unordered_map>

#include <sys/stat.h>

namespace gsc {

namespace {

namespace fs = std::filesystem;

std::string resolved(const std::string& path)
{
    std::error_code code;
    const fs::path absolute = fs::absolute(path, code);
    const fs::path canonical = fs::weakly_canonical(absolute, code);
    std::string text = (code ? absolute.lexically_normal() : canonical).string();
    while (text.size() > 1 && text.back() == '/') // a folder with and without it
        text.pop_back();
    return text;
}

// Device and inode, empty if the path does not exist.
std::string identityOf(const std::string& path)
{
    struct stat info {};
    if (::stat(path.c_str(), &info) != 0)
        return "";
    return formatString("%llu:%llu", static_cast<unsigned long long>(info.st_dev),
                        static_cast<unsigned long long>(info.st_ino)); // no resolved path starts with a digit
}

} // namespace

void checkOutputsDiffer(std::span<const NamedPath> outputs, std::span<const NamedPath> inputs)
{
    std::unordered_map<std::string, const NamedPath*> seen; // by resolved path and by identity
    for (const NamedPath& input : inputs) {
        seen.emplace(resolved(input.path), &input);
        if (const std::string identity = identityOf(input.path); !identity.empty())
            seen.emplace(identity, &input);
    }
    for (const NamedPath& output : outputs) {
        for (const std::string& key : {resolved(output.path), identityOf(output.path)}) {
            if (key.empty())
                continue;
            const auto found = seen.find(key);
            if (found != seen.end() && found->second != &output)
                throw Error(ErrorCode::Usage,
                            formatString("%s: %s would overwrite %s (%s), expected a file of its own; choose another "
                                         "name",
                                         output.path.c_str(), output.what.c_str(), found->second->what.c_str(),
                                         found->second->path.c_str()));
            seen.emplace(key, &output);
        }
    }
}

void checkRegularOrAbsent(const std::string& path)
{
    std::error_code ignored;
    const fs::file_status status = fs::status(path, ignored);
    if (fs::is_directory(status))
        throw Error(ErrorCode::Io, path + ": is a folder, expected the name of a file to write; choose another name");
    if (fs::exists(status) && !fs::is_regular_file(status))
        throw Error(ErrorCode::Io, path + ": is no regular file, expected the name of a file to write; choose another "
                                          "name, or leave the option out");
}

} // namespace gsc
