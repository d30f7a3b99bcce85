// SPDX-License-Identifier: Apache-2.0
// Second pass over a checkpoint: appends every anchor, as a record, to the place of its chunk in section ANCH.
#pragma once

#include "convert/write/partition.h"
#include <gsc/gsc_writer.h>

#include <cstdint>
#include <functional>
#include <span>

namespace gsc {

// `chunks`: where the chunks lie (payload_offset). `buffer_bytes`: memory for records that wait to be written. Records
// of a chunk are written in the order of the source. Throws Error (Io, InvalidFile if the source has changed).
void distributeAnchors(AnchorSource& source, const ScanResult& scan, const Partition& partition,
                       const ModelParams& params, std::span<const ChunkRecord> chunks, uint64_t buffer_bytes,
                       GscWriter& writer, const std::function<void(uint64_t)>& progress);

} // namespace gsc
