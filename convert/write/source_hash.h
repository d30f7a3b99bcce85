// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "convert/input/checkpoint.h"

#include <cstdint>
#include <stop_token>

namespace gsc {

struct SourceHash {
    // see FileHeader::source_hash: of the PLY, then of the weight files in the order in which they were read
    uint64_t hash = 0;
    uint64_t bytes = 0; // size of all these files together
};

// Hashes the files of a checkpoint by reading them once more. Throws Error: Io, Interrupted (Ctrl-C, or a request on
// `stop`, which may come from any thread).
SourceHash hashSources(const Checkpoint& checkpoint, const std::stop_token& stop = {});

} // namespace gsc
