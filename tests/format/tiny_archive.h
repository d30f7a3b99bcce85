// SPDX-License-Identifier: Apache-2.0
// Small archives in memory, to read and to break.
#pragma once

#include <gsc/archive_layout.h>
#include "tests/format/tiny_gsc.h"

#include <cstddef>
#include <span>
#include <string>
#include <vector>

namespace gsc::test {

// An archive of `file`, which must open with GscCheck::Index. It is written to a file in `folder`, which stays.
std::vector<std::byte> archiveOf(std::span<const std::byte> file, const std::string& folder, int threads = 2);

// tinyGsc() with features and offsets on power-of-two steps, and some slots masked.
std::vector<std::byte> tinyStepsGsc(const TinyGscOptions& options);

// Records of an archive; precondition: its tables are sound.
ArchiveHeader& archiveHeader(std::span<std::byte> archive);
std::span<ArchivePart> archiveParts(std::span<std::byte> archive);
std::span<std::byte> storedPart(std::span<std::byte> archive, const ArchivePart& part);

// Room for a file that is decoded: zero, and as aligned as a mapping.
class AlignedRoom {
public:
    explicit AlignedRoom(uint64_t bytes);
    [[nodiscard]] std::span<std::byte> bytes() const { return m_bytes; }

private:
    std::vector<std::byte> m_room;
    std::span<std::byte> m_bytes;
};

// Makes every checksum but those of decoded bytes true again. Safe on any bytes.
void resealArchive(std::span<std::byte> archive);

} // namespace gsc::test
