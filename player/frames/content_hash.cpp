// SPDX-License-Identifier: Apache-2.0
#include "player/frames/content_hash.h"

#include <gsc/file/mapped_file.h>
#include <gsc/gsc_layout.h>
#include "player/model/converted_model.h"

#include <algorithm>
#include <cstring>

namespace gsc {

void addPoses(std::span<const Shot> shots, uint32_t eye_count, Checksum64& sum)
{
    for (const Shot& shot : shots) {
        EyeParams eyes[kMaxEyes];
        std::memset(eyes, 0, sizeof(eyes)); // padding between fields must not change the checksum
        shotEyes(shot, eye_count, eyes);
        sum.update(std::as_bytes(std::span(eyes)));
        sum.update(std::as_bytes(std::span(&shot.appearance, 1)));
    }
}

uint64_t fileHash(const std::string& path)
{
    const MappedFile file(gscPath(path));
    FileHeader header{};
    std::memcpy(&header, file.bytes().data(), std::min(sizeof(header), file.bytes().size()));
    return header.header_checksum;
}

} // namespace gsc
