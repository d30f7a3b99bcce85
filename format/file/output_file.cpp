// SPDX-License-Identifier: Apache-2.0
#include <gsc/file/output_file.h>

#include <gsc/error.h>
#include <gsc/interrupt.h>
#include "format/file/temporary.h"

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <optional>

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

namespace gsc {

namespace {

// Writes all `bytes` at `offset`, or appends them if `offset` is negative. Returns 0, or errno of the failure.
int writeAll(int fd, int64_t offset, std::span<const std::byte> bytes)
{
    while (!bytes.empty()) {
        // note: Linux moves at most 2 GiB - 4 KiB in one call, so a large write is several
        const ssize_t done = offset < 0 ? ::write(fd, bytes.data(), bytes.size())
                                        : ::pwrite(fd, bytes.data(), bytes.size(), off_t(offset));
        if (done < 0 && errno == EINTR)
            continue;
        if (done <= 0)
            return done < 0 ? errno : ENOSPC;
        bytes = bytes.subspan(size_t(done));
        if (offset >= 0)
            offset += done;
    }
    return 0;
}

void writeStandardOutput(std::span<const std::byte> bytes)
{
    const int code = std::fflush(stdout) != 0 ? errno : writeAll(STDOUT_FILENO, -1, bytes);
    if (code == EPIPE)
        throw Error(ErrorCode::Io, "standard output", "the program that read it has ended", "it to read on",
                    "let it take all, or redirect to a file");
    if (code != 0)
        throw Error(ErrorCode::Io, "standard output", formatString("cannot be written (%s)", std::strerror(code)),
                    "room for the output", "redirect it to another place");
}

// Renames the temporary to its target. Without `overwrite` the kernel itself refuses a target that exists: by
// RENAME_NOREPLACE, or by link() on file systems without that flag; on a file system with neither, a plain rename
// replaces the target.
void giveName(const std::string& temporary, const std::string& target, const std::string& shown, bool overwrite)
{
    if (!overwrite) {
        if (::renameat2(AT_FDCWD, temporary.c_str(), AT_FDCWD, target.c_str(), RENAME_NOREPLACE) == 0)
            return;
        if (errno != EEXIST && ::link(temporary.c_str(), target.c_str()) == 0) {
            ::unlink(temporary.c_str());
            return;
        }
        if (errno == EEXIST)
            throw Error(ErrorCode::Io, shown, "appeared while it was being written", "no such file", "have it replaced")
                .with({Setting::Overwrite});
    }
    if (::rename(temporary.c_str(), target.c_str()) != 0)
        failOutput(shown, "cannot rename the finished file", errno);
}

} // namespace

struct OutputFile::State {
    std::string path, target; // path: as given; target: with symbolic links followed, empty for standard output
    bool overwrite = false, synced = false;
    std::optional<Temporary> temporary;
};

OutputFile::OutputFile(const std::string& path, OutputKind kind, bool overwrite) : m_state(std::make_unique<State>())
{
    checkOutput(path, kind, overwrite);
    m_state->path = path;
    m_state->overwrite = overwrite;
    if (isStandardOutput(path))
        return;
    m_state->target = resolveOutput(path);
    // if the old file is not readable by others, the new one is not either, from its creation on
    struct stat info {};
    const bool exists = ::lstat(m_state->target.c_str(), &info) == 0;
    m_state->temporary.emplace(m_state->target, TemporaryKind::File, exists ? 0600 : 0666);
}

OutputFile::~OutputFile() = default;

int OutputFile::descriptor() const
{
    return m_state->temporary ? m_state->temporary->descriptor() : STDOUT_FILENO;
}

const std::string& OutputFile::temporaryPath() const
{
    return m_state->temporary.value().path();
}

void OutputFile::write(std::span<const std::byte> bytes)
{
    if (!m_state->temporary)
        return writeStandardOutput(bytes);
    if (const int code = writeAll(descriptor(), -1, bytes))
        failOutput(m_state->path, "cannot be written", code);
}

void OutputFile::writeAt(uint64_t offset, std::span<const std::byte> bytes)
{
    if (const int code = writeAll(descriptor(), int64_t(offset), bytes))
        failOutput(m_state->path, "cannot be written", code);
}

void OutputFile::sync()
{
    if (m_state->temporary && ::fsync(descriptor()) != 0)
        failOutput(m_state->path, "cannot be flushed to disk", errno);
    m_state->synced = true;
}

void OutputFile::commit()
{
    State& s = *m_state;
    if (!s.temporary)
        return;
    struct stat info {};
    if (s.overwrite && ::lstat(s.target.c_str(), &info) == 0) {
        mode_t mode = info.st_mode & 0777;
        struct stat own {};
        (void)!::fstat(descriptor(), &own);
        // only root can give a file to another owner, but its group may be any group of the writer. An owner or group
        // that cannot be kept is no error: the group bits of the mode are then cleared, and others get no more than the
        // old group had, for its members are now among the others
        if ((own.st_uid != info.st_uid || own.st_gid != info.st_gid) &&
            ::fchown(descriptor(), info.st_uid, info.st_gid) != 0 && own.st_gid != info.st_gid &&
            ::fchown(descriptor(), uid_t(-1), info.st_gid) != 0)
            mode &= 0700 | (mode >> 3 & 07);
        // if this fails, the temporary stays readable by its owner alone
        (void)!::fchmod(descriptor(), mode);
    }
    // closes a duplicate to learn of a late error: a network file system may report a full disk only on close(); the
    // lock must last beyond the rename
    const int twin = ::fcntl(descriptor(), F_DUPFD_CLOEXEC, 0);
    if (twin >= 0 && ::close(twin) != 0)
        failOutput(s.path, "cannot be closed", errno);
    giveName(s.temporary->path(), s.target, s.path, s.overwrite);
    s.temporary->release();
    if (!s.synced)
        return;
    // makes the new name survive a power cut; file systems that cannot do so return an error, which is ignored
    const int folder = ::open(folderOf(s.target).c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (folder >= 0) {
        ::fsync(folder);
        ::close(folder);
    }
}

OutputFiles::~OutputFiles()
{
    m_files.clear();
    for (auto folder = m_folders.rbegin(); folder != m_folders.rend(); ++folder)
        ::rmdir(folder->c_str()); // refuses a folder that is not empty
}

void OutputFiles::makeFolder(const std::string& path)
{
    const std::string target = resolveOutput(path);
    struct stat info {};
    if (::stat(target.c_str(), &info) == 0 && S_ISDIR(info.st_mode))
        return;
    if (::mkdir(target.c_str(), 0777) != 0)
        failOutput(path, "the folder cannot be made", errno);
    m_folders.push_back(target);
}

void OutputFiles::add(const std::string& path, OutputKind kind, std::string_view bytes)
{
    throwIfInterrupted();
    m_files.push_back(std::make_unique<OutputFile>(path, kind, m_overwrite));
    m_files.back()->write(bytes);
    m_files.back()->sync();
}

void OutputFiles::commit()
{
    throwIfInterrupted();
    for (const std::unique_ptr<OutputFile>& file : m_files)
        file->commit();
    m_files.clear();
    m_folders.clear();
}

void writeTextFile(const std::string& path, std::string_view text, bool overwrite)
{
    OutputFile file(path, OutputKind::Text, overwrite);
    file.write(text);
    file.sync();
    file.commit();
}

namespace {

struct Descriptor {
    int fd;
    ~Descriptor() { ::close(fd); }
};

// Returns the number of bytes up to the last line end; `tail` gets the bytes behind it. Returns -1 with errno on
// failure.
int64_t wholeLines(int fd, std::string& tail)
{
    struct stat info {};
    if (::fstat(fd, &info) != 0)
        return -1;
    int64_t end = info.st_size;
    char buffer[4096];
    tail.clear();
    while (end > 0) {
        const auto want = size_t(std::min<int64_t>(end, sizeof(buffer)));
        if (::pread(fd, buffer, want, end - int64_t(want)) != ssize_t(want))
            return -1;
        const std::string_view block(buffer, want);
        const size_t newline = block.rfind('\n');
        tail.insert(0, block.substr(newline == std::string_view::npos ? 0 : newline + 1));
        if (newline != std::string_view::npos)
            return end - int64_t(want) + int64_t(newline) + 1;
        end -= int64_t(want);
    }
    return 0;
}

} // namespace

bool isCutLine(std::string_view tail, std::string_view line_start)
{
    return tail.starts_with(line_start) || (tail.size() > 1 && line_start.starts_with(tail));
}

void appendLine(const std::string& path, std::string_view line, std::string_view line_start,
                const std::function<bool(std::string_view)>& is_whole)
{
    std::string text = std::string(line) + "\n";
    if (isStandardOutput(path))
        return writeStandardOutput(std::as_bytes(std::span(text)));
    checkAppend(path);
    const Descriptor file{
        ::open(resolveOutput(path).c_str(), O_RDWR | O_CREAT | O_APPEND | O_CLOEXEC | O_NOFOLLOW, 0666)};
    if (file.fd < 0)
        failOutput(path, "cannot be written", errno);
    // a file system without locks is accepted: a single write is not mixed with others there either
    while (::flock(file.fd, LOCK_EX) != 0 && errno == EINTR)
        ;
    std::string tail;
    int64_t size = wholeLines(file.fd, tail);
    if (size >= 0 && tail.starts_with(line_start) && !tail.empty() && is_whole(tail)) {
        size += int64_t(tail.size());
        tail.clear();
        text.insert(0, "\n");
    }
    if (size >= 0 && !tail.empty() && !isCutLine(tail, line_start))
        throw Error(ErrorCode::InvalidFile, path, "its last line has no end and is no row that was cut", "whole lines",
                    "choose another file");
    if (size < 0 || (!tail.empty() && ::ftruncate(file.fd, size) != 0))
        failOutput(path, "cannot be cut to its whole lines", errno);
    if (const int code = writeAll(file.fd, -1, std::as_bytes(std::span(text)))) {
        (void)!::ftruncate(file.fd, size);
        failOutput(path, "cannot be written", code);
    }
}

} // namespace gsc
