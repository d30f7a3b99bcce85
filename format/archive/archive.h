// SPDX-License-Identifier: Apache-2.0
// Archives as a whole (archive_layout.h): written from a runtime file, and read back to its bytes.
#pragma once

#include "format/archive/part_codec.h"
#include <gsc/gsc_status.h>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>

namespace gsc {

struct ArchiveOptions {
    int level = 3;   // compression level of Zstandard, 1..19
    int threads = 0; // 0: all cores. The bytes do not depend on it
};

struct ArchiveSize {
    uint32_t type; // ArchivePart::type
    uint64_t raw_bytes = 0, stored_bytes = 0;
};

struct ArchiveSizes {
    uint64_t raw_bytes = 0, stored_bytes = 0; // bytes of the runtime file and of the archive
    std::vector<ArchiveSize> sections;        // in the order of the runtime file
};

// Writes an archive of `file`, a runtime file, to `path`. Every part is decoded again before it is written. `progress` is
// told the raw bytes that are done and all of them, from one thread at a time. Throws Error: as
// GscWriter; Unsupported where this build lacks a codec; InvalidFile where a byte that belongs to nothing is not zero;
// Interrupted. Precondition: `view` came from openGsc() on `file` without errors.
ArchiveSizes writeArchive(std::span<const std::byte> file, const GscView& view, const std::string& path, bool overwrite,
                          const ArchiveOptions& options, const std::function<void(uint64_t, uint64_t)>& progress);

// True if a file that starts with these bytes claims to be an archive.
[[nodiscard]] bool isArchive(std::span<const std::byte> file);

class Archive {
public:
    // Checks header, tables and the list of parts of `file`, which must outlive this. Reports every problem to `sink`;
    // isSound() is then false. Nothing is decoded.
    Archive(std::span<const std::byte> file, const IssueSink& sink);

    [[nodiscard]] bool isSound() const { return m_sound; }
    [[nodiscard]] uint64_t rawBytes() const { return m_raw_bytes; } // bytes of the runtime file
    [[nodiscard]] std::span<const ArchivePart> parts() const { return m_parts; }

    enum class Scope {
        All,
        Summary, // header, table, META, PARM and LEVL, which openGscSummary() reads
    };
    // Bytes that decode() writes, padding not counted. Precondition: isSound().
    [[nodiscard]] uint64_t decodedBytes(Scope scope) const;
    // The runtime file into `out`: rawBytes() bytes, zero, aligned to 4096. False if something was reported; then `out` is
    // of no use. Throws Error(Interrupted). Precondition: isSound().
    bool decode(std::span<std::byte> out, Scope scope, int threads, const IssueSink& sink) const;

private:
    std::span<const std::byte> m_data;
    std::span<const ArchivePart> m_parts;
    uint64_t m_data_offset = 0;
    uint64_t m_raw_bytes = 0;
    bool m_sound = false;
};

} // namespace gsc
