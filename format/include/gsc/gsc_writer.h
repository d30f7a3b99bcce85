// SPDX-License-Identifier: Apache-2.0
// Writes a .gsc file, with sections aligned and gaps filled with zeros, through OutputFile (output_file.h). The bytes
// depend only on what is passed in, never on time, threads or addresses.
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

    // Reserves the ANCH section, zero filled, as the first of the file. Called once, before any other section is added.
    void reserveAnchors(uint64_t bytes);
    // Write bytes to ANCH, and read them back; `offset` counts from the start of ANCH. Thread-safe. Throw Error(Io),
    // also when the disk is full.
    void writeAnchors(uint64_t offset, std::span<const std::byte> bytes);
    void readAnchors(uint64_t offset, std::span<std::byte> bytes) const;

    // Appends a section. The sections lie in the file in the order of the calls.
    void addSection(uint32_t type, std::span<const std::byte> content, uint64_t count, uint32_t flags = 0);

    // Append a section of unknown size: beginSection(), then its pieces, then its count and checksum.
    void beginSection(uint32_t type);
    void append(std::span<const std::byte> piece);
    void endSection(uint64_t count, uint64_t checksum);

    // Writes the section table and the header, and waits for the disk. `header` supplies anchor_count, source_hash,
    // config_hash and profile, the rest is filled in; `anchors_checksum` is SectionEntry::checksum of ANCH. Returns the
    // size of the file in bytes.
    uint64_t finish(const FileHeader& header, uint64_t anchors_checksum);
    [[nodiscard]] const std::string& temporaryPath() const; // path of the temporary file, until commit()
    // Gives the finished file its name. Throws Error(Io); the target is then as it was.
    void commit();

private:
    struct State;
    std::unique_ptr<State> m_state;
};

} // namespace gsc
