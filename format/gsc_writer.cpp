// SPDX-License-Identifier: Apache-2.0
#include <gsc/gsc_writer.h>

#include <gsc/checksum.h>
#include <gsc/error.h>
#include <gsc/file/output_file.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <vector>

#include <fcntl.h>
#include <unistd.h>

namespace gsc {

namespace {

// header and table with kMaxSections entries fit before the first section, so the place of that section never depends
// on their number
static_assert(sizeof(FileHeader) + kMaxSections * sizeof(SectionEntry) <= kSectionAlign);

// Reserves disk blocks for `bytes` at `offset`, so a disk too small is noticed before the work and not after it.
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
        failOutput(path, formatString("cannot reserve %llu bytes", (unsigned long long)bytes).c_str(), errno);
#endif
    if (::ftruncate(fd, off_t(offset + bytes)) != 0)
        failOutput(path, formatString("cannot reserve %llu bytes", (unsigned long long)bytes).c_str(), errno);
}

} // namespace

struct GscWriter::State {
    State(const std::string& name, bool overwrite) : path(name), file(name, OutputKind::Binary, overwrite) {}

    std::string path;
    OutputFile file;
    bool finished = false;
    uint64_t anchors_offset = 0;
    uint64_t anchors_bytes = 0;
    bool has_anchors = false;
    uint64_t cursor = kSectionAlign; // offset in the file where the next section goes
    std::vector<SectionEntry> entries;

    void append(uint32_t type, uint64_t bytes, uint64_t count, uint32_t flags, uint64_t checksum)
    {
        if (entries.size() >= kMaxSections)
            throw internalError(path, "more sections", formatString("at most %u", kMaxSections));
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

GscWriter::GscWriter(const std::string& path, bool overwrite) : m_state(std::make_unique<State>(path, overwrite)) {}

GscWriter::~GscWriter() = default;

void GscWriter::reserveAnchors(uint64_t bytes)
{
    State& s = *m_state;
    if (s.has_anchors || !s.entries.empty())
        throw internalError(s.path, "ANCH comes behind other sections", "it first");
    reserveBlocks(s.file.descriptor(), s.path, s.cursor, bytes);
    s.has_anchors = true;
    s.anchors_offset = s.cursor;
    s.anchors_bytes = bytes;
    s.append(kSectionAnchors, bytes, 0, 0, 0);
}

void GscWriter::writeAnchors(uint64_t offset, std::span<const std::byte> bytes)
{
    State& s = *m_state;
    if (offset > s.anchors_bytes || bytes.size() > s.anchors_bytes - offset)
        throw internalError(s.path, "a write outside ANCH", "one inside");
    s.file.writeAt(s.anchors_offset + offset, bytes);
}

void GscWriter::readAnchors(uint64_t offset, std::span<std::byte> bytes) const
{
    const State& s = *m_state;
    if (offset > s.anchors_bytes || bytes.size() > s.anchors_bytes - offset)
        throw internalError(s.path, "a read outside ANCH", "one inside");
    offset += s.anchors_offset;
    while (!bytes.empty()) {
        const ssize_t done = ::pread(s.file.descriptor(), bytes.data(), bytes.size(), off_t(offset));
        if (done < 0 && errno == EINTR)
            continue;
        if (done < 0)
            failOutput(s.path, "cannot be read back", errno);
        if (done == 0) // 0: a file system without fallocate(); bytes not written yet read as zero there too
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
    s.file.writeAt(offset, content);
}

void GscWriter::beginSection(uint32_t type)
{
    m_state->append(type, 0, 0, 0, 0);
}

void GscWriter::append(std::span<const std::byte> piece)
{
    SectionEntry& entry = m_state->entries.back();
    m_state->file.writeAt(entry.offset + entry.bytes, piece);
    entry.bytes += piece.size();
}

void GscWriter::endSection(uint64_t count, uint64_t checksum)
{
    SectionEntry& entry = m_state->entries.back();
    entry.count = count;
    entry.checksum = checksum;
    m_state->cursor = alignUp(entry.offset + entry.bytes, kSectionAlign);
}

uint64_t GscWriter::finish(const FileHeader& header, uint64_t anchors_checksum)
{
    State& s = *m_state;
    if (s.finished)
        throw internalError(s.path, "finished twice", "once");
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

    // gaps between the sections were never written and read as zero
    if (::ftruncate(s.file.descriptor(), off_t(s.cursor)) != 0)
        failOutput(s.path, "cannot set its size", errno);
    s.file.writeAt(0, front);
    s.file.sync();
    s.finished = true;
    return s.cursor;
}

const std::string& GscWriter::temporaryPath() const
{
    return m_state->file.temporaryPath();
}

void GscWriter::commit()
{
    if (!m_state->finished)
        throw internalError(m_state->path, "named before it was finished", "finish() first");
    m_state->file.commit();
}

} // namespace gsc
