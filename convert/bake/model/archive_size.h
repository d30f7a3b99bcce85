// SPDX-License-Identifier: Apache-2.0
// Size of the archive that a file would become, by kind of value.
#pragma once

#include <gsc/gsc_file.h>
#include <gsc/gsc_reader.h>

#include <cstdint>

namespace gsc {

struct StoredBytes {
    uint64_t positions = 0; // positions and source indices
    uint64_t scales = 0, offsets = 0, features = 0;
    uint64_t other_anchors = 0; // other arrays of anchors, and the heads of chunks
    uint64_t networks = 0;
    uint64_t rest = 0; // index, cameras, manifest
    uint64_t file = 0; // the whole archive

    [[nodiscard]] uint64_t anchors() const { return positions + scales + offsets + features + other_anchors; }
};

// Bytes of a runtime file and of its archive.
struct BakeSizes {
    uint64_t file = 0;
    StoredBytes archive;
};

// Packs every part as `gsc archive` does, but keeps only the sizes, and frees the pages it has read. Precondition: `view`
// came from openGsc() on all of `file`, without errors. Throws Error(Interrupted, Unsupported).
[[nodiscard]] StoredBytes archiveSize(const GscFile& file, const GscView& view, int threads);

} // namespace gsc
