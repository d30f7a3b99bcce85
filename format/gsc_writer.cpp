// SPDX-License-Identifier: Apache-2.0
#include "format/gsc_writer.h"

#include "format/checksum.h"
#include "format/error.h"

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <utility>
#include <vector>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

namespace gsc {

namespace {

// header and table of kMaxSections entries fit in front of the first section, so its place never depends on their number
static_assert(sizeof(FileHeader) + kMaxSections * sizeof(SectionEntry) <= kSectionAlign);

[[noreturn]] void throwErrno(const std::string& path, const char* what, int code)
{
    const char* hint = code == ENOSPC || code == EDQUOT ? "; free some space or write to another disk" : "";
    throw Error(ErrorCode::Io, formatString("%s: %s: %s%s", path.c_str(), what, std::strerror(code), hint));
}

std::string directoryOf(const std::string& path)
{
    const size_t slash = path.rfind('/');
    return slash == std::string::npos ? "." : slash == 0 ? "/" : path.substr(0, slash);
}

void writeAll(int fd, const std::string& path, uint64_t offset, std::span<const std::byte> bytes)
{
    while (!bytes.empty()) {
        // note: Linux moves at most 2 GiB - 4 KiB in one call, so a large write is several
        const ssize_t done = ::pwrite(fd, bytes.data(), bytes.size(), off_t(offset));
        if (done < 0 && errno == EINTR)
            continue;
        if (done <= 0)
            throwErrno(path, "cannot write", done < 0 ? errno : ENOSPC);
        offset += uint64_t(done);
        bytes = bytes.subspan(size_t(done));
    }
}

int createExclusive(const std::string& path, std::string& temporary)
{
    // a leftover of a killed process with the same id must not stop this one, nor be overwritten
    for (int attempt = 0; attempt < 100; ++attempt) {
        temporary = formatString("%s.%ld.%d.tmp", path.c_str(), long(::getpid()), attempt);
        const int fd = ::open(temporary.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
        if (fd >= 0 || errno != EEXIST)
            return fd;
    }
    errno = EEXIST;
    return -1;
}

// Blocks for `bytes` at `offset`, so that a disk that is too small shows before the work and not after it.
void reserveBlocks(int fd, const std::string& path, uint64_t offset, uint64_t bytes)
{
    if (bytes == 0)
        return;
#if defined(__linux__)
    int result;
    do
        result = ::fallocate(fd, 0, off_t(offset), off_t(bytes));
    while (result != 0 && errno == EINTR);
    if (result == 0)
        return;
    if (errno != EOPNOTSUPP && errno != ENOSYS)
        throwErrno(path, formatString("cannot reserve %llu bytes", (unsigned long long)bytes).c_str(), errno);
#endif
    if (::ftruncate(fd, off_t(offset + bytes)) != 0)
        throwErrno(path, formatString("cannot reserve %llu bytes", (unsigned long long)bytes).c_str(), errno);
}

void renameOver(const std::string& temporary, const std::string& path, bool overwrite)
{
    if (!overwrite) {
        // link() refuses an existing target, which rename() would replace; filesystems without links fall through
        if (::link(temporary.c_str(), path.c_str()) == 0) {
            ::unlink(temporary.c_str());
            return;
        }
        if (errno == EEXIST)
            throw Error(ErrorCode::Io,
                        formatString("%s: appeared while it was being written, expected no such file; pass -w to "
                                     "overwrite it",
                                     path.c_str()));
    }
    if (::rename(temporary.c_str(), path.c_str()) != 0)
        throwErrno(path, "cannot rename the finished file", errno);
}

} // namespace

struct GscWriter::State {
    std::string path;
    std::string temporary;
    bool overwrite = false;
    int fd = -1;
    uint64_t anchors_offset = 0;
    uint64_t anchors_bytes = 0;
    bool has_anchors = false;
    uint64_t cursor = kSectionAlign; // where the next section starts
    std::vector<SectionEntry> entries;

    void append(uint32_t type, uint64_t bytes, uint64_t count, uint32_t flags, uint64_t checksum)
    {
        if (entries.size() >= kMaxSections)
            throw Error(ErrorCode::Internal, formatString("%s: more than %u sections", path.c_str(), kMaxSections));
        SectionEntry entry{};
        entry.type = type;
        entry.version = 1;
        entry.flags = flags;
        entry.offset = cursor;
        entry.bytes = bytes;
        entry.checksum = checksum;
        entry.count = count;
        entries.push_back(entry);
        cursor = alignUp(cursor + bytes, kSectionAlign);
    }
};

GscWriter::GscWriter(const std::string& path, bool overwrite) : m_state(std::make_unique<State>())
{
    struct stat info {};
    if (::stat(path.c_str(), &info) == 0) {
        if (!S_ISREG(info.st_mode))
            throw Error(ErrorCode::Io, formatString("%s: exists and is not a regular file, expected a file name; "
                                                    "choose another output",
                                                    path.c_str()));
        if (!overwrite)
            throw Error(
                ErrorCode::Io,
                formatString("%s: already exists, expected no such file; pass -w to overwrite it", path.c_str()));
    }
    m_state->path = path;
    m_state->overwrite = overwrite;
    m_state->fd = createExclusive(path, m_state->temporary);
    if (m_state->fd < 0) {
        const int code = errno;
        m_state->temporary.clear();
        throwErrno(path, "cannot create a temporary file beside it", code);
    }
}

GscWriter::~GscWriter()
{
    if (m_state->fd >= 0)
        ::close(m_state->fd);
    if (!m_state->temporary.empty())
        ::unlink(m_state->temporary.c_str());
}

void GscWriter::reserveAnchors(uint64_t bytes)
{
    State& s = *m_state;
    if (s.has_anchors || !s.entries.empty())
        throw Error(ErrorCode::Internal, formatString("%s: ANCH must be the first section", s.path.c_str()));
    reserveBlocks(s.fd, s.path, s.cursor, bytes);
    s.has_anchors = true;
    s.anchors_offset = s.cursor;
    s.anchors_bytes = bytes;
    s.append(kSectionAnchors, bytes, 0, 0, 0);
}

void GscWriter::writeAnchors(uint64_t offset, std::span<const std::byte> bytes)
{
    const State& s = *m_state;
    if (offset > s.anchors_bytes || bytes.size() > s.anchors_bytes - offset)
        throw Error(ErrorCode::Internal, formatString("%s: write outside ANCH", s.path.c_str()));
    writeAll(s.fd, s.path, s.anchors_offset + offset, bytes);
}

void GscWriter::readAnchors(uint64_t offset, std::span<std::byte> bytes) const
{
    const State& s = *m_state;
    if (offset > s.anchors_bytes || bytes.size() > s.anchors_bytes - offset)
        throw Error(ErrorCode::Internal, formatString("%s: read outside ANCH", s.path.c_str()));
    offset += s.anchors_offset;
    while (!bytes.empty()) {
        const ssize_t done = ::pread(s.fd, bytes.data(), bytes.size(), off_t(offset));
        if (done < 0 && errno == EINTR)
            continue;
        if (done < 0)
            throwErrno(s.path, "cannot read back", errno);
        if (done == 0) // a filesystem without fallocate: what was never written reads as zero
            break;
        offset += uint64_t(done);
        bytes = bytes.subspan(size_t(done));
    }
    std::fill(bytes.begin(), bytes.end(), std::byte{0});
}

void GscWriter::addSection(uint32_t type, std::span<const std::byte> content, uint64_t count, uint32_t flags)
{
    State& s = *m_state;
    const uint64_t offset = s.cursor;
    s.append(type, content.size(), count, flags, checksum64(content));
    writeAll(s.fd, s.path, offset, content);
}

uint64_t GscWriter::finish(const FileHeader& header, uint64_t anchors_checksum)
{
    State& s = *m_state;
    if (s.fd < 0)
        throw Error(ErrorCode::Internal, formatString("%s: finished twice", s.path.c_str()));
    FileHeader out{};
    std::copy(std::begin(kMagic), std::end(kMagic), out.magic);
    out.version_major = kVersionMajor;
    out.version_minor = kVersionMinor;
    out.header_bytes = sizeof(FileHeader);
    out.file_bytes = s.cursor;
    out.section_count = uint32_t(s.entries.size());
    out.section_entry_bytes = sizeof(SectionEntry);
    out.section_offset = sizeof(FileHeader);
    out.anchor_count = header.anchor_count;
    out.source_hash = header.source_hash;
    out.config_hash = header.config_hash;
    out.profile = header.profile;
    if (s.has_anchors) {
        s.entries.front().checksum = anchors_checksum;
        s.entries.front().count = header.anchor_count;
    }

    std::vector<std::byte> front(sizeof(FileHeader) + s.entries.size() * sizeof(SectionEntry));
    std::memcpy(front.data(), &out, sizeof(out));
    if (!s.entries.empty())
        std::memcpy(front.data() + sizeof(out), s.entries.data(), s.entries.size() * sizeof(SectionEntry));
    out.header_checksum = checksum64(front);
    std::memcpy(front.data(), &out, sizeof(out));

    // what lies between the sections was never written and reads as zero
    if (::ftruncate(s.fd, off_t(s.cursor)) != 0)
        throwErrno(s.path, "cannot set its size", errno);
    writeAll(s.fd, s.path, 0, front);
    if (::fsync(s.fd) != 0)
        throwErrno(s.path, "cannot flush it to disk", errno);
    const int fd = std::exchange(s.fd, -1);
    if (::close(fd) != 0) // the last chance of a network filesystem to say that the disk is full
        throwErrno(s.path, "cannot close it", errno);
    renameOver(s.temporary, s.path, s.overwrite);
    s.temporary.clear();

    // the new name must survive a power cut too; filesystems that cannot do that say so, which is no reason to fail
    const int directory = ::open(directoryOf(s.path).c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (directory >= 0) {
        ::fsync(directory);
        ::close(directory);
    }
    return s.cursor;
}

} // namespace gsc
