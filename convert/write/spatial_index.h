// SPDX-License-Identifier: Apache-2.0
// The occupied cells of a level as a NanoVDB mask grid, built with OpenVDB, and such grids as OpenVDB's file: the module
// gsc_index_openvdb.
#pragma once

#include "convert/write/chunk_build.h"

#include <cstddef>
#include <span>
#include <string>
#include <vector>

namespace gsc {

// Returns the grid's bytes, a multiple of 32, the same for the same input; fills in LeafRecord::nanovdb_index.
// `leaves` = all leaves of the level. World space of the grid is the model's: a voxel's centre is that of its quanta.
// `check` is called now and then, to throw if interrupted.
std::vector<std::byte> buildNanoVdb(const LevelRecord& level, PositionEncoding encoding, std::span<LeafBuild> leaves,
                                    void (*check)());

// An OpenVDB file of NanoVDB mask grids, each a whole grid that is known to be good, with its name and its map. Equal
// input gives equal bytes: `id` takes the place of the random number that such a file has.
std::string openVdbFile(std::span<const std::byte* const> grids, uint64_t id, void (*check)());

// World units: cells of a level are at least as large.
constexpr double kLeastCell = 2e-5;

// Threads that OpenVDB's log starts when it is loaded, at the least.
constexpr size_t kSpatialIndexThreads = 4;

struct SpatialIndexFunctions { // functions of the module
    decltype(&buildNanoVdb) build;
    decltype(&openVdbFile) file;
};

} // namespace gsc
