// SPDX-License-Identifier: Apache-2.0
// The stored grids as files of other tools.
#pragma once

#include <gsc/gsc_reader.h>

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

namespace gsc {

enum class GridFileFormat {
    NanoVdb, // .nvdb as nanovdb::io writes it, not compressed: the stored bytes behind a header
    OpenVdb, // .vdb
};

struct ExportedGrid {
    int32_t level;
    std::string name; // "level_2"
    uint64_t leaves, voxels;
    double voxel_size; // world units
};

// Hands the file to `write` piece by piece: one mask grid per level, in the order of view.levels, in the world space of
// the model. Equal files give equal bytes. Precondition: `view` came from openGsc() without errors. A grid that cannot
// be walked is reported to `sink`; then nothing is written and the list is empty. Throws Error(Unsupported) where OpenVDB is
// missing.
std::vector<ExportedGrid> writeGridFile(const GscView& view, GridFileFormat format, const IssueSink& sink,
                                        const std::function<void(std::string_view)>& write);

} // namespace gsc
