// SPDX-License-Identifier: Apache-2.0
// First pass over a checkpoint: finds which anchors can be used, which values are equal for all, and which levels there
// are.
#pragma once

#include "convert/input/checkpoint.h"
#include "convert/survey/grid_fit.h"

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <vector>

namespace gsc {

struct ScannedPlace {
    float position[3];
    int32_t level;
};

struct ScanResult {
    uint64_t rows = 0; // rows of the source, used or not
    uint64_t kept = 0;
    std::vector<uint64_t> dropped;         // numbers of the dropped rows, ascending
    std::vector<std::string> warnings;     // anchors that were dropped, and why
    std::map<int32_t, LevelRecord> levels; // for each level: count and bounds of the anchors that are kept
    std::vector<GridSample> samples;       // some coordinates from all over the file
    // Positions and levels of the anchors that are kept; empty if they need more than `placement_bytes`.
    std::vector<ScannedPlace> placements;
    // kModelHasRotation, kModelHasOpacity, kModelHasNormal for values that differ between anchors
    uint32_t varying = 0;
    float rotation[4] = {1, 0, 0, 0}; // rotation of the first anchor that is kept
    float opacity = 0;
};

// Scans all anchors. `drop_invalid`: leave out anchors that cannot be shown, instead of throwing. `placement_bytes`:
// memory for ScanResult::placements. Throws Error(InvalidFile) for anchors that cannot be shown, if none is left, and
// if the number of rows is not the checkpoint's.
ScanResult scanAnchors(AnchorSource& source, const Checkpoint& checkpoint, bool drop_invalid, uint64_t placement_bytes,
                       const std::function<void(uint64_t)>& progress);

// Calls `work` with the positions and levels of the anchors that are kept, in order: from ScanResult::placements, or by
// reading the source again if it is empty.
void forEachPlacement(AnchorSource& source, const ScanResult& scan,
                      const std::function<void(std::span<const ScannedPlace>)>& work);

} // namespace gsc
