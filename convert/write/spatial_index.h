// SPDX-License-Identifier: Apache-2.0
// Builds the occupied cells of a level as a NanoVDB mask grid with OpenVDB, and writes such grids as an OpenVDB file.
// These functions lie in the module gsc_index_openvdb.
#pragma once

#include "convert/write/chunk_build.h"

#include <cstddef>
#include <span>
#include <string>
#include <vector>

namespace gsc {

// Returns the bytes of the grid, a multiple of 32, always the same for the same input, and sets
// LeafRecord::nanovdb_index. `leaves`: all leaves of the level. The grid has the world space of the model: the centre
// of a voxel is the centre of its quanta. `check` is called now and then; it may throw.
std::vector<std::byte> buildNanoVdb(const LevelRecord& level, PositionEncoding encoding, std::span<LeafBuild> leaves,
                                    void (*check)());

// Returns an OpenVDB file of these NanoVDB mask grids, with their names and transforms. The grids must have been
// validated. Equal input gives equal bytes: `id` replaces the random number in such a file. `check` is called per grid;
// it may throw.
std::string openVdbFile(std::span<const std::byte* const> grids, uint64_t id, void (*check)());

// Least width of a cell in world units, because OpenVDB takes no smaller voxels.
constexpr double kLeastCell = 2e-5;

// Threads that the process must at least be able to start: OpenVDB's log starts some when it is loaded.
constexpr size_t kSpatialIndexThreads = 4;

struct SpatialIndexFunctions { // the functions above, as the module exports them
    decltype(&buildNanoVdb) build;
    decltype(&openVdbFile) file;
};

} // namespace gsc
