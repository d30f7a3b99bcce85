// SPDX-License-Identifier: Apache-2.0
// A .gsc file as the writer takes a checkpoint.
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
// META, or an empty object where it is none or nests too deep for a person to have meant it.
[[nodiscard]] OrderedJson manifestOf(std::string_view manifest);
// The options that a file of the same anchors would be made with again, byte for byte.
[[nodiscard]] WriteOptions writeOptionsOf(const GscView& view);

// Weights as the nearest halves.
void roundToHalves(std::vector<Mlp>& mlps);

// All anchors of a file in the order that takes fewest bits: by level, then along the Morton curve of their grid; floats
// stay as they lie. Or in the order of their source numbers.
[[nodiscard]] std::vector<uint32_t> anchorOrder(const GscView& view, bool by_source);

} // namespace gsc
