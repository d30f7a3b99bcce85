// SPDX-License-Identifier: Apache-2.0
// Finds the integer grid of trained anchors: every coordinate is fl32(fl32(k * v_L) + origin) with an integer k, v_L =
// fl32(voxel_size / fork^level) and one origin for all axes. voxel_size and origin are found so that this holds bit for
// bit; trainers never store the origin, and not always the voxel size.
#pragma once

#include <gsc/gsc_layout.h>

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace gsc {

// k is below this: with nodes of 128 quanta a Morton key then fits into 63 bits
constexpr int32_t kMaxQuanta = 1 << 27;

struct GridPoint {
    int32_t quanta;
    bool negative_zero;
};

// The integer k from which gridCoordinate() computes `value` bit for bit; none if there is no such k below kMaxQuanta.
[[nodiscard]] std::optional<GridPoint> locateOnGrid(float value, float quantum, float origin);

// v_L, the edge of a voxel of a level, as the trainer computes it.
[[nodiscard]] float levelQuantum(float voxel_size, uint32_t fork, int32_t level);

// One coordinate of an anchor, of any axis.
struct GridSample {
    float value;
    int32_t level;
};

struct Grid {
    float voxel_size = 0;
    float origin = 0;
};

struct GridHints {
    float voxel_size = 0; // edge of a voxel of level 0 as the checkpoint states it; 0 = unknown
    uint32_t fork = 2;
    // true for Octree-GS; the origin of Scaffold-GS is 0
    bool may_have_origin = false;
    bool fixed = false; // only voxel_size may be used
};

// Returns a grid that reproduces every sample, or none. `samples` is sorted and freed of duplicates. Equal input gives
// equal results; takes a fraction of a second for some 10^5 samples.
[[nodiscard]] std::optional<Grid> fitGrid(std::vector<GridSample>& samples, const GridHints& hints);

} // namespace gsc
