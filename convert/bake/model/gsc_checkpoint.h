// SPDX-License-Identifier: Apache-2.0
// Makes of a .gsc file the checkpoint that the writer takes.
#pragma once

#include "convert/input/checkpoint.h"
#include "convert/write/write_gsc.h"
#include <gsc/gsc_reader.h>
#include "runtime/cli/json.h"

#include <string>
#include <string_view>
#include <vector>

namespace gsc {

// All of the checkpoint but its anchors. `path` names the file in messages. Precondition: openGsc() opened `view`
// without errors.
[[nodiscard]] Checkpoint checkpointOf(const GscView& view, const std::string& path);
// The manifest (section META) as JSON; an empty object if it is no JSON object or nested too deep.
[[nodiscard]] OrderedJson manifestOf(std::string_view manifest);
// Options with which the writer makes of the same anchors the same file, byte for byte.
[[nodiscard]] WriteOptions writeOptionsOf(const GscView& view);

// Rounds all weights to the nearest half-precision number.
void roundToHalves(std::vector<Mlp>& mlps);

// Indices of all anchors of a file in the order that packs best: by level, then along the Morton curve of the grid.
// Models with float positions keep their order. `by_source`: ordered by source index instead.
[[nodiscard]] std::vector<uint32_t> anchorOrder(const GscView& view, bool by_source);

} // namespace gsc
