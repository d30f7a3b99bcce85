// SPDX-License-Identifier: Apache-2.0
#include "convert/grids/grid_files.h"

#include "convert/grids/stored_grid.h"
#include "convert/write/spatial_index.h"
#include <gsc/interrupt.h>
#include "kernels/threads/tbb_bound.h"
#include "runtime/module/load_module.h"

#include <nanovdb/util/IO.h>

#include <deque>
#include <sstream>

namespace gsc {

namespace {

using Write = std::function<void(std::string_view)>;

void writeNanoVdb(const std::deque<StoredGrid>& grids, const Write& write)
{
    nanovdb::io::Segment segment;
    for (const StoredGrid& stored : grids) {
        const StoredGrid::Grid& grid = *stored.grid();
        nanovdb::io::GridMetaData& data = segment.meta.emplace_back(grid.gridSize(), segment.header.codec, grid);
        data.fileSize = grid.gridSize();
        data.padding = 0;
        ++segment.header.gridCount;
    }
    std::ostringstream head;
    segment.write(head);
    write(head.str());
    for (const StoredGrid& stored : grids) {
        throwIfInterrupted();
        write({reinterpret_cast<const char*>(stored.grid()), stored.grid()->gridSize()});
    }
}

void writeOpenVdb(const std::deque<StoredGrid>& grids, uint64_t id, const Write& write)
{
    boundTbb();
    std::vector<const std::byte*> bytes;
    for (const StoredGrid& stored : grids)
        bytes.push_back(reinterpret_cast<const std::byte*>(stored.grid()));
    const auto& functions = loadModule<SpatialIndexFunctions>("gsc_index_openvdb", kSpatialIndexThreads);
    write(functions.file(bytes, id, throwIfInterrupted));
}

} // namespace

std::vector<ExportedGrid> writeGridFile(const GscView& view, GridFileFormat format, const IssueSink& sink,
                                        const Write& write)
{
    std::deque<StoredGrid> grids;
    std::vector<ExportedGrid> exported;
    for (uint32_t l = 0; l < view.levels.size(); ++l) {
        const StoredGrid& stored = grids.emplace_back(view, l, sink);
        if (stored.grid() == nullptr)
            return {};
        const StoredGrid::Grid& grid = *stored.grid();
        exported.push_back({view.levels[l].level, grid.gridName(), view.levels[l].leaf_count, grid.activeVoxelCount(),
                            grid.voxelSize()[0]});
    }
    if (format == GridFileFormat::NanoVdb)
        writeNanoVdb(grids, write);
    else
        writeOpenVdb(grids, view.header->source_hash ^ view.header->config_hash, write);
    return exported;
}

} // namespace gsc
