// SPDX-License-Identifier: Apache-2.0
// A .gsc file of either profile, as the bytes of a runtime file: mapped, or decoded into memory.
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
        Summary, // decode only the part of an archive that openGscSummary() reads; the rest is zero
    };

    // Reports every problem of an archive to `sink`; isSound() is then false. The content of a runtime file
    // is not looked at: openGsc() does that. `threads` decode, 0 = all cores. Throws Error: as MappedFile and
    // refuseStandIn(); OutOfMemory for an archive that does not fit this machine; Interrupted.
    GscFile(const std::string& path, const IssueSink& sink, Read read = Read::All, int threads = 0);
    ~GscFile();
    GscFile(const GscFile&) = delete;
    GscFile& operator=(const GscFile&) = delete;

    [[nodiscard]] bool isSound() const noexcept { return m_sound; }
    [[nodiscard]] bool isArchive() const noexcept { return m_is_archive; }
    [[nodiscard]] uint64_t storedBytes() const noexcept { return m_stored_bytes; } // bytes on the disk
    // Aligned to 4096, valid as long as this object lives. Precondition: isSound().
    [[nodiscard]] std::span<const std::byte> bytes() const noexcept { return m_bytes; }
    // Gives back the memory of the pages that `part` of bytes() lies in. Reading them again maps them again, from the
    // system's cache or the disk. Bytes that an archive was decoded to stay: they lie nowhere else. From any thread.
    void letGo(std::span<const std::byte> part) const noexcept;

private:
    MappedFile m_file;
    std::span<std::byte> m_decoded;
    std::span<const std::byte> m_bytes;
    uint64_t m_stored_bytes = 0;
    bool m_is_archive = false, m_sound = true;
};

} // namespace gsc
