// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "convert/input/checkpoint.h"

#include <cstdint>

namespace gsc {

struct SourceHash {
    uint64_t hash = 0;  // FileHeader::source_hash: the PLY, then the weight files in the order they were read
    uint64_t bytes = 0; // of all of them
};

// Reads the files once more, plainly; throws Error(Io).
SourceHash hashSources(const Checkpoint& checkpoint);

} // namespace gsc
