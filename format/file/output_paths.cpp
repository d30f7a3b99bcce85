// SPDX-License-Identifier: Apache-2.0
#include <gsc/file/output_paths.h>

#include <gsc/error.h>

#include <cerrno>
#include <climits>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <unordered_map>

#include <fcntl.h>
#include <linux/magic.h>
#include <sys/stat.h>
#include <sys/vfs.h>
#include <unistd.h>

namespace gsc {

namespace {

namespace fs = std::filesystem;

std::string resolved(const std::string& path)
{
    std::string target = path;
    try {
        target = resolveOutput(path); // follows also links to paths that do not exist yet
    } catch (const Error&) {          // ignored: an input may be a device; checkOutput() reports an output
    }
    std::error_code code;
    const fs::path absolute = fs::absolute(target, code);
    const fs::path canonical = fs::weakly_canonical(absolute, code);
    std::string text = (code ? absolute.lexically_normal() : canonical).string();
    while (text.size() > 1 && text.back() == '/') // so that a folder is equal with and without its last slash
        text.pop_back();
    return text;
}

// Device and inode number as text, equal for two names of one file; empty if the path does not exist.
std::string identityOf(const std::string& path)
{
    struct stat info {};
    if (::stat(path.c_str(), &info) != 0)
        return "";
    return formatString("%llu:%llu", static_cast<unsigned long long>(info.st_dev),
                        // starts with a digit, which no resolved path does
                        static_cast<unsigned long long>(info.st_ino));
}

// Throws Error(Io) for a path in /dev, or in the folder of a process's open descriptors: no output may replace such a
// file.
void refuseSystemFolder(const std::string& path, const std::string& folder)
{
    struct statfs system {};
    const bool is_proc = ::statfs(folder.c_str(), &system) == 0 && system.f_type == PROC_SUPER_MAGIC;
    if (is_proc || folder == "/dev" || folder == "/dev/fd")
        throw Error(
            ErrorCode::Io, path, std::string("lies in ") + (is_proc ? "/proc" : "/dev") + " and is no regular file",
            "the name of a file to write", "choose another name, or - for standard output where the output is a text");
}

} // namespace

void checkOutputsDiffer(std::span<const NamedPath> outputs, std::span<const NamedPath> inputs)
{
    // outputs and inputs so far, by resolved path and by identityOf()
    std::unordered_map<std::string, const NamedPath*> seen;
    for (const NamedPath& input : inputs) {
        seen.emplace(resolved(input.path), &input);
        if (const std::string identity = identityOf(input.path); !identity.empty())
            seen.emplace(identity, &input);
    }
    for (const NamedPath& output : outputs) {
        if (isStandardOutput(output.path))
            continue;
        for (const std::string& key : {resolved(output.path), identityOf(output.path)}) {
            if (key.empty())
                continue;
            const auto found = seen.find(key);
            if (found != seen.end() && found->second != &output)
                throw Error(ErrorCode::Usage, output.path,
                            formatString("%s would overwrite %s (%s)", output.what.c_str(), found->second->what.c_str(),
                                         found->second->path.c_str()),
                            "a file of its own", "choose another name");
            seen.emplace(key, &output);
        }
    }
}

bool isStandardOutput(const std::string& path)
{
    return path == "-";
}

void checkStandardOutput(const std::string& path, const char* option, bool json_summary)
{
    if (isStandardOutput(path) && json_summary)
        throw Error(ErrorCode::Usage, formatString("%s -", option), "goes where the report goes as JSON", "one of them",
                    formatString("have the report as text, or give %s a file", option))
            .with({Setting::ReportFormat});
}

std::string folderOf(const std::string& path)
{
    const size_t slash = path.rfind('/');
    return slash == std::string::npos ? "." : slash == 0 ? "/" : path.substr(0, slash);
}

void failOutput(const std::string& path, const char* what, int code)
{
    if (code == EBUSY) // EBUSY: a mount point, such as a single file mounted into a container
        throw Error(ErrorCode::Io, path, formatString("is a mount point or in use (%s)", std::strerror(code)),
                    "a file that can be replaced", "write into the folder it lies in, under another name");
    const bool full = code == ENOSPC || code == EDQUOT || code == EFBIG;
    throw Error(code == ENOMEM ? ErrorCode::OutOfMemory : ErrorCode::Io, path,
                formatString("%s (%s)", what, std::strerror(code)),
                full ? "room for it" : "a folder that is there and may be written",
                full ? "free some space or write to another disk" : "check the path and its rights");
}

std::string resolveOutput(const std::string& path)
{
    if (path.empty())
        throw Error(ErrorCode::Io, "output", "the name is empty", "the name of a file", "give one");
    constexpr int kMostLinks = 40; // symbolic links in a row that the kernel follows at most
    std::string at = path;
    for (int links = 0; links <= kMostLinks; ++links) {
        while (at.size() > 1 && at.back() == '/') // with a slash at the end lstat() would follow the link
            at.pop_back();
        std::string folder = folderOf(at);
        if (char* const real = ::realpath(folder.c_str(), nullptr)) {
            folder = real;
            std::free(real);
        } else if (errno == ENOENT) {
            return at; // nothing exists there, which is for the caller to judge
        } else {
            failOutput(path, "cannot be reached", errno);
        }
        refuseSystemFolder(path, folder);
        const size_t slash = at.rfind('/');
        const std::string name = slash == std::string::npos ? at : at.substr(slash + 1);
        const std::string found = name.empty() ? folder : (folder == "/" ? "" : folder) + "/" + name;
        struct stat info {};
        if (::lstat(found.c_str(), &info) != 0) {
            if (errno == ENOENT)
                return found;
            failOutput(path, "cannot be reached", errno);
        }
        if (!S_ISLNK(info.st_mode))
            return found;
        char target[PATH_MAX];
        const ssize_t size = ::readlink(found.c_str(), target, sizeof(target));
        if (size <= 0 || size == ssize_t(sizeof(target)))
            failOutput(path, "is a link that cannot be read", size < 0 ? errno : ENAMETOOLONG);
        const std::string text(target, size_t(size));
        at = text.front() == '/' ? text : (folder == "/" ? "" : folder) + "/" + text;
    }
    failOutput(path, "is a loop of links", ELOOP);
}

void checkOutput(const std::string& path, OutputKind kind, bool overwrite, OutputFolder folder)
{
    if (isStandardOutput(path)) {
        if (kind == OutputKind::Text)
            return;
        throw Error(ErrorCode::Usage, "-", "is standard output", "the name of a file, since this output is binary",
                    "pass ./- for a file of that name");
    }
    const std::string target = resolveOutput(path);
    const char* const other =
        kind == OutputKind::Text ? "choose another name, or - for standard output" : "choose another name";
    struct stat info {};
    const bool exists = ::lstat(target.c_str(), &info) == 0;
    if (exists && S_ISDIR(info.st_mode))
        throw Error(ErrorCode::Io, path, "is a folder", "the name of a file to write", other);
    if (path.back() == '/')
        throw Error(ErrorCode::Io, path, "ends in a slash", "the name of a file to write", other);
    if (exists && !S_ISREG(info.st_mode))
        throw Error(ErrorCode::Io, path, "is no regular file", "the name of a file to write", other);
    if (exists && !overwrite)
        throw Error(ErrorCode::Io, path, "already exists", "no such file", "choose another name or have it replaced")
            .with({Setting::Overwrite});
    const std::string parent = folderOf(target);
    if (::lstat(parent.c_str(), &info) != 0) {
        if (folder == OutputFolder::IsMade)
            return;
        throw Error(ErrorCode::Io, path, "its folder does not exist", "an existing one", "create " + parent + " first");
    }
    if (::faccessat(AT_FDCWD, parent.c_str(), W_OK | X_OK, AT_EACCESS) != 0)
        failOutput(path, "its folder cannot be written", errno);
}

void checkAppend(const std::string& path)
{
    if (isStandardOutput(path))
        return;
    const std::string target = resolveOutput(path);
    struct stat info {};
    if (::lstat(target.c_str(), &info) != 0 || !S_ISREG(info.st_mode))
        checkOutput(path, OutputKind::Text, true);
    else if (::faccessat(AT_FDCWD, target.c_str(), R_OK | W_OK, AT_EACCESS) != 0)
        failOutput(path, "cannot be written", errno);
}

void checkOutputFolder(const std::string& path, bool overwrite)
{
    if (isStandardOutput(path))
        throw Error(ErrorCode::Usage, "-", "is standard output", "the name of a folder",
                    "pass ./- for a folder of that name");
    const std::string target = resolveOutput(path);
    std::error_code code;
    const fs::file_status status = fs::symlink_status(target, code);
    if (fs::exists(status) && !fs::is_directory(status))
        throw Error(ErrorCode::Io, path, "is a file", "the name of a folder to create", "choose another name");
    if (fs::exists(status) && !fs::is_empty(target, code) && !overwrite)
        throw Error(ErrorCode::Io, path, "already exists", "no such folder",
                    "choose another name or have what is in it replaced")
            .with({Setting::Overwrite});
}

} // namespace gsc
