// SPDX-License-Identifier: Apache-2.0
// Writes a .gsc file, aligned and zero padded, as every output is written (output_file.h). Deterministic: the bytes
// depend on what is passed in, never on time, threads or addresses.
#pragma once

#include <gsc/gsc_layout.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>

namespace gsc {

class GscWriter {
public:
    // Creates the temporary file. Throws Error as checkOutput(), and Error(Io).
    GscWriter(const std::string& path, bool overwrite);
    ~GscWriter(); // removes the temporary file unless commit() succeeded
    GscWriter(const GscWriter&) = delete;
    GscWriter& operator=(const GscWriter&) = delete;

    // Reserves the ANCH section, first in the file, zero filled. Called once, before any other section is added.
    void reserveAnchors(uint64_t bytes);
    // Positional I/O inside ANCH; offsets from its start. Thread-safe. Throws Error(Io), also when the disk is full.
    void writeAnchors(uint64_t offset, std::span<const std::byte> bytes);
    void readAnchors(uint64_t offset, std::span<std::byte> bytes) const;

    // Appends a section. Order of calls = order in the file.
    void addSection(uint32_t type, std::span<const std::byte> content, uint64_t count, uint32_t flags = 0);

    // Append a section whose size shows only when it is written: its pieces, then its count and checksum.
    void beginSection(uint32_t type);
    void append(std::span<const std::byte> piece);
    void endSection(uint64_t count, uint64_t checksum);

    // Writes table and header (`header` supplies anchor_count, source_hash, config_hash, profile; the rest is filled
    // in), fsync. `anchors_checksum` as SectionEntry::checksum says. Returns the file's size.
    uint64_t finish(const FileHeader& header, uint64_t anchors_checksum);
    [[nodiscard]] const std::string& temporaryPath() const; // path of the file until commit()
    // Gives the finished file its name. Throws Error(Io); the target is then as it was.
    void commit();

private:
    struct State;
    std::unique_ptr<State> m_state;
};

} // namespace gsc
