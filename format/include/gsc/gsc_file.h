// SPDX-License-Identifier: Apache-2.0
// Bytes of a runtime file, from a .gsc file of either profile: a runtime file is mapped, an archive is decoded into
// memory.
#pragma once

#include <gsc/file/mapped_file.h>
#include <gsc/gsc_status.h>

#include <cstddef>
#include <span>
#include <string>

namespace gsc {

class GscFile {
public:
    enum class Read {
        All,
        Summary, // an archive: only the part that openGscSummary() reads; the rest is zero
    };

    // Opens the file. Reports every problem of an archive to `sink`; isSound() is then false. The content of a runtime
    // file is not checked here, but by openGsc(). `threads`: number of threads that decode, 0 = all cores. Throws
    // Error: as MappedFile and refuseStandIn(); OutOfMemory for an archive that does not fit this machine; Interrupted.
    GscFile(const std::string& path, const IssueSink& sink, Read read = Read::All, int threads = 0);
    ~GscFile();
    GscFile(const GscFile&) = delete;
    GscFile& operator=(const GscFile&) = delete;

    [[nodiscard]] bool isSound() const noexcept { return m_sound; }
    [[nodiscard]] bool isArchive() const noexcept { return m_is_archive; }
    // size of the file on the disk in bytes
    [[nodiscard]] uint64_t storedBytes() const noexcept { return m_stored_bytes; }
    // Bytes of the runtime file, aligned to 4096, valid as long as this object lives. Precondition: isSound().
    [[nodiscard]] std::span<const std::byte> bytes() const noexcept { return m_bytes; }
    // Gives the memory pages of `part`, which lies in bytes(), back to the system. When they are read again, they come
    // from the system's file cache or the disk. Does nothing for an archive, whose decoded bytes are nowhere else. May
    // be called from any thread.
    void letGo(std::span<const std::byte> part) const noexcept;

private:
    MappedFile m_file;
    std::span<std::byte> m_decoded;
    std::span<const std::byte> m_bytes;
    uint64_t m_stored_bytes = 0;
    bool m_is_archive = false, m_sound = true;
};

} // namespace gsc
