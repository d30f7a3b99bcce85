// SPDX-License-Identifier: Apache-2.0
// Facts of a model, in equal words for a checkpoint and for a .gsc file.
#pragma once

#include "convert/commands/command.h"
#include <gsc/gsc_layout.h>

#include <string>

namespace gsc {

// The object "model" of every report (schemas/model.schema.json), and its text: a few lines without a line end after
// the last. Precondition: `params` come from a checkpoint, or from a file that was opened without errors.
Json modelJson(const ModelParams& params, uint64_t anchors);
std::string modelText(const ModelParams& params, uint64_t anchors);

// Words for what `gsc bake` says of itself in the manifest under "reduction", on one line without its end; "" for
// anything that is no object. The manifest may come from anybody.
std::string bakedText(const Json& reduction);

} // namespace gsc
