// SPDX-License-Identifier: Apache-2.0
// The integer grid trained anchors lie on (format facts 5.3): every coordinate is fl32(fl32(k * v_L) + origin) with
// v_L = fl32(voxel_size / fork^level) and the same origin on all axes. Finds voxel_size and origin so that this holds
// bit for bit; the origin is stored nowhere by the trainers, the voxel size not always.
#pragma once

#include <gsc/gsc_layout.h>

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace gsc {

constexpr int32_t kMaxQuanta = 1 << 27; // exclusive; with 128 quanta per finest node a Morton key then fits 63 bits

struct GridPoint {
    int32_t quanta;
    bool negative_zero;
};

// The quanta that gridCoordinate() turns back into `value` bit for bit; empty if there are none below kMaxQuanta.
[[nodiscard]] std::optional<GridPoint> locateOnGrid(float value, float quantum, float origin);

// v_L as the trainer computes it.
[[nodiscard]] float levelQuantum(float voxel_size, uint32_t fork, int32_t level);

// One coordinate, whatever its axis.
struct GridSample {
    float value;
    int32_t level;
};

struct Grid {
    float voxel_size = 0;
    float origin = 0;
};

struct GridHints {
    float voxel_size = 0; // as the checkpoint says, 0 = unknown
    uint32_t fork = 2;
    bool may_have_origin = false; // Octree-GS; Scaffold-GS grids start at 0
    bool fixed = false;           // no other voxel size will do
};

// A grid that reproduces every sample, or empty. `samples` is sorted and freed of duplicates in place.
// Deterministic; a fraction of a second for some 10^5 samples.
[[nodiscard]] std::optional<Grid> fitGrid(std::vector<GridSample>& samples, const GridHints& hints);

} // namespace gsc
