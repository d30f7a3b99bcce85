// SPDX-License-Identifier: Apache-2.0
// Writes a runtime file as an archive (archive_layout.h), and reads an archive back to the bytes of its runtime file.
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
    int threads = 0; // number of threads, 0: all cores; the bytes of the archive do not depend on it
};

struct ArchiveSize {
    uint32_t type; // type of the section, as ArchivePart::type
    uint64_t raw_bytes = 0, stored_bytes = 0;
};

struct ArchiveSizes {
    uint64_t raw_bytes = 0, stored_bytes = 0; // bytes of the runtime file and of the archive
    std::vector<ArchiveSize> sections;        // sizes of each section, in the order of the runtime file
};

// Writes an archive of the runtime file `file` to `path`. Every part is decoded again before it is written. `progress`
// is called with the bytes of `file` that are done and with all of them, by one thread at a time. Throws Error: as
// GscWriter; Unsupported where this build lacks a codec; InvalidFile where a byte of `file` that belongs to no part is
// not zero; Interrupted. Precondition: `view` came from openGsc() on `file` without errors.
ArchiveSizes writeArchive(std::span<const std::byte> file, const GscView& view, const std::string& path, bool overwrite,
                          const ArchiveOptions& options, const std::function<void(uint64_t, uint64_t)>& progress);

// Returns true if a file that starts with these bytes claims to be an archive.
[[nodiscard]] bool isArchive(std::span<const std::byte> file);

class Archive {
public:
    // Checks header, tables and the list of parts of `file`, whose bytes must live longer than this object. Reports
    // every problem to `sink`; isSound() is then false. Nothing is decoded.
    Archive(std::span<const std::byte> file, const IssueSink& sink);

    [[nodiscard]] bool isSound() const { return m_sound; }
    [[nodiscard]] uint64_t rawBytes() const { return m_raw_bytes; } // bytes of the runtime file
    [[nodiscard]] std::span<const ArchivePart> parts() const { return m_parts; }

    enum class Scope {
        All,
        Summary, // only the header, the table, META, PARM and LEVL, which openGscSummary() reads
    };
    // Bytes that decode() writes, padding not counted. Precondition: isSound().
    [[nodiscard]] uint64_t decodedBytes(Scope scope) const;
    // Decodes the runtime file into `out`, which has rawBytes() bytes, all zero, aligned to 4096. Returns false if a
    // problem was reported; the content of `out` is then of no use. Throws Error(Interrupted). Precondition: isSound().
    bool decode(std::span<std::byte> out, Scope scope, int threads, const IssueSink& sink) const;

private:
    std::span<const std::byte> m_data;
    std::span<const ArchivePart> m_parts;
    uint64_t m_data_offset = 0;
    uint64_t m_raw_bytes = 0;
    bool m_sound = false;
};

} // namespace gsc
