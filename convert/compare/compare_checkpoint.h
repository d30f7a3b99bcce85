// SPDX-License-Identifier: Apache-2.0
// Compares every value of a checkpoint with the .gsc made from it, bit for bit.
#pragma once

#include "convert/write/write_gsc.h"
#include <gsc/gsc_reader.h>

#include <cstdint>
#include <string>
#include <vector>

namespace gsc {

struct AttributeDifference {
    std::string name;       // such as "position", "feature", "opacity_mlp.weight0", "camera.fx"
    uint64_t compared = 0;  // number of values compared
    uint64_t different = 0; // number of values whose bits differ
    // largest absolute difference; infinite if one side is NaN or infinite and the other is not
    double max_abs = 0;
    // first difference: source index of the anchor, or number of the value if it belongs to no anchor
    uint64_t first = 0;
};

struct CompareReport {
    bool equal = false;
    uint64_t anchors = 0; // number of anchors compared
    // anchors of the checkpoint that --drop-invalid left out, as the manifest of the file states
    uint64_t dropped = 0;
    // JSON of what `gsc bake` says of itself in the manifest of the file; empty = the file is not baked
    std::string reduction;
    std::vector<AttributeDifference> attributes;
    std::vector<std::string> problems; // differences that are not of single values: counts, settings, missing parts

    [[nodiscard]] std::string summary() const; // returns one line of text; "no difference" if all is equal
};

// Compares the checkpoint with the file `gsc_path`. Memory does not grow with the model. Throws Error: Io; InvalidFile
// if the file is damaged.
CompareReport compareCheckpoint(const Checkpoint& checkpoint, const std::string& gsc_path,
                                const WriteProgress& progress);
// Compares as above, with the anchors of `source`. Precondition: `view` came from openGsc() without errors.
CompareReport compareCheckpoint(const Checkpoint& checkpoint, AnchorSource& source, const GscView& view,
                                const WriteProgress& progress);

} // namespace gsc
