// SPDX-License-Identifier: Apache-2.0
// Second pass over a checkpoint: every anchor is appended, as a record, to the region of its chunk in ANCH.
#pragma once

#include "convert/write/partition.h"
#include <gsc/gsc_writer.h>

#include <cstdint>
#include <functional>
#include <span>

namespace gsc {

// `chunks` gives the regions (payload_offset); `buffer_bytes` bounds the memory for gathering records before they are
// written. Records of a chunk are in source order. Throws Error (Io, InvalidFile if the source changed).
void distributeAnchors(AnchorSource& source, const ScanResult& scan, const Partition& partition,
                       const ModelParams& params, std::span<const ChunkRecord> chunks, uint64_t buffer_bytes,
                       GscWriter& writer, const std::function<void(uint64_t)>& progress);

} // namespace gsc
