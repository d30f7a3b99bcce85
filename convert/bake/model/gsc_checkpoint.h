// SPDX-License-Identifier: Apache-2.0
// A .gsc file as a checkpoint, for the writer.
#pragma once

#include "convert/input/checkpoint.h"
#include "convert/write/write_gsc.h"
#include <gsc/gsc_reader.h>
#include "runtime/cli/json.h"

#include <string>
#include <string_view>
#include <vector>

namespace gsc {

// Everything but the anchors. `path` names it in messages. Precondition: openGsc() opened `view` without errors.
[[nodiscard]] Checkpoint checkpointOf(const GscView& view, const std::string& path);
// The manifest (META), or an empty object if it is no JSON object or nests too deep.
[[nodiscard]] OrderedJson manifestOf(std::string_view manifest);
// Options that would make a file of the same anchors again, byte for byte.
[[nodiscard]] WriteOptions writeOptionsOf(const GscView& view);

// Rounds weights to the nearest halves.
void roundToHalves(std::vector<Mlp>& mlps);

// Indices of all anchors of a file in the order that packs best: by level, then along the Morton curve of their grid; float
// positions keep their order. by_source: in the order of their source indices instead.
[[nodiscard]] std::vector<uint32_t> anchorOrder(const GscView& view, bool by_source);

} // namespace gsc
