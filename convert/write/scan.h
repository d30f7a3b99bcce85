// SPDX-License-Identifier: Apache-2.0
// First pass over a checkpoint: which anchors are usable, what is constant, which levels there are.
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
    uint64_t rows = 0; // rows of the source
    uint64_t kept = 0;
    std::vector<uint64_t> dropped;         // rows, ascending
    std::vector<std::string> warnings;     // left out anchors, and why
    std::map<int32_t, LevelRecord> levels; // number, count and bounds of the anchors kept
    std::vector<GridSample> samples;       // coordinates spread over the file, bounded
    // positions and levels of the anchors kept; empty if they would not fit the budget
    std::vector<ScannedPlace> placements;
    uint32_t varying = 0;             // kModelHasRotation, kModelHasOpacity, kModelHasNormal
    float rotation[4] = {1, 0, 0, 0}; // rotation of the first anchor kept
    float opacity = 0;
};

// Throws Error(InvalidFile) for anchors that cannot be shown (unless they are dropped), for none left and for a
// row count other than the checkpoint's. `placement_bytes`: memory for ScanResult::placements.
ScanResult scanAnchors(AnchorSource& source, const Checkpoint& checkpoint, bool drop_invalid, uint64_t placement_bytes,
                       const std::function<void(uint64_t)>& progress);

// The placements of the anchors kept, in order: from memory, or by reading the source again.
void forEachPlacement(AnchorSource& source, const ScanResult& scan,
                      const std::function<void(std::span<const ScannedPlace>)>& work);

} // namespace gsc
