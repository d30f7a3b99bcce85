// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "convert/input/checkpoint.h"

#include <cstdint>
#include <stop_token>

namespace gsc {

struct SourceHash {
    uint64_t hash = 0;  // FileHeader::source_hash: the PLY, then the weight files in the order they were read
    uint64_t bytes = 0; // bytes of all files together
};

// Reads the files once more, plainly. Throws Error: Io, Interrupted (Ctrl-C, or `stop`, which may come from any thread).
SourceHash hashSources(const Checkpoint& checkpoint, const std::stop_token& stop = {});

} // namespace gsc
