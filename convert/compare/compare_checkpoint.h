// SPDX-License-Identifier: Apache-2.0
// Every value of a checkpoint against the .gsc made from it, bit for bit.
#pragma once

#include "convert/write/write_gsc.h"
#include <gsc/gsc_reader.h>

#include <cstdint>
#include <string>
#include <vector>

namespace gsc {

struct AttributeDifference {
    std::string name;       // "position", "feature", "opacity_mlp.weight0", "camera.fx", ...
    uint64_t compared = 0;  // values
    uint64_t different = 0; // values whose bits differ
    double max_abs = 0;     // largest absolute difference; infinite if a NaN or an infinity is on one side only
    uint64_t first = 0;     // first difference: source index of the anchor, else of the element
};

struct CompareReport {
    bool equal = false;
    uint64_t anchors = 0; // compared
    uint64_t dropped = 0; // anchors of the checkpoint that --drop-invalid left out of the file, by the file's manifest
    std::vector<AttributeDifference> attributes;
    std::vector<std::string> problems; // differences that are not of values: counts, settings, missing parts

    [[nodiscard]] std::string summary() const; // one line; "no difference" if equal
};

// Memory does not grow with the model. Throws Error: Io, InvalidFile if the .gsc is damaged.
CompareReport compareCheckpoint(const Checkpoint& checkpoint, const std::string& gsc_path,
                                const WriteProgress& progress);
// Precondition: `view` came from openGsc() without errors.
CompareReport compareCheckpoint(const Checkpoint& checkpoint, AnchorSource& source, const GscView& view,
                                const WriteProgress& progress);

} // namespace gsc
