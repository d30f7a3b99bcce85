// SPDX-License-Identifier: Apache-2.0
// Writes the stored NanoVDB grids as files of other tools.
#pragma once

#include <gsc/gsc_reader.h>

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

namespace gsc {

enum class GridFileFormat {
    NanoVdb, // .nvdb as nanovdb::io writes it, uncompressed: the stored bytes behind a header
    OpenVdb, // OpenVDB's own format, .vdb
};

struct ExportedGrid {
    int32_t level;
    std::string name; // such as "level_2"
    uint64_t leaves, voxels;
    double voxel_size; // edge of a voxel in world units
};

// Passes the bytes of a file to `write` piece by piece: one mask grid per level, in the order of view.levels, in the
// world space of the model. Equal input gives equal bytes. Precondition: `view` came from openGsc() without errors. A
// grid whose nodes are damaged is reported to `sink`; then nothing is written, and an empty list is returned. Throws
// Error(Unsupported) if this build has no OpenVDB.
std::vector<ExportedGrid> writeGridFile(const GscView& view, GridFileFormat format, const IssueSink& sink,
                                        const std::function<void(std::string_view)>& write);

} // namespace gsc
