// SPDX-License-Identifier: Apache-2.0
// Computes the size that a file has when it is packed (gsc archive), by kind of value.
#pragma once

#include <gsc/gsc_file.h>
#include <gsc/gsc_reader.h>

#include <cstdint>

namespace gsc {

struct StoredBytes {
    uint64_t positions = 0; // bytes of positions and source indices
    uint64_t scales = 0, offsets = 0, features = 0;
    uint64_t other_anchors = 0; // other arrays of the anchors, and the headers of chunks
    uint64_t networks = 0;
    uint64_t rest = 0; // spatial index, cameras, manifest
    uint64_t file = 0; // size of the whole archive in bytes

    [[nodiscard]] uint64_t anchors() const { return positions + scales + offsets + features + other_anchors; }
};

// Sizes in bytes of one .gsc file and of the archive that it packs into.
struct BakeSizes {
    uint64_t file = 0;
    StoredBytes archive;
};

// Packs every part as `gsc archive` does but keeps only the sizes; frees the memory of the pages that were read.
// Precondition: `view` came from openGsc() on all of `file`, without errors. Throws Error(Interrupted, Unsupported).
[[nodiscard]] StoredBytes archiveSize(const GscFile& file, const GscView& view, int threads);

} // namespace gsc
