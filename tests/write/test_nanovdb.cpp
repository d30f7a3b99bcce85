// SPDX-License-Identifier: Apache-2.0
#include "convert/grids/locate.h"
#include "convert/grids/nanovdb_check.h"
#include "tests/write/memory_model.h"

#include <doctest/doctest.h>

#include <nanovdb/NanoVDB.h>

#include <cmath>
#include <cstring>
#include <set>

using namespace gsc;
using namespace gsc::test;

namespace {

Written writeOctree(uint64_t anchors, int32_t spread)
{
    ModelShape shape;
    shape.anchors = anchors;
    shape.levels = 2;
    shape.origin = -5.3f;
    shape.spread = spread;
    WriteOptions options;
    options.chunk_anchors = 200;
    return writeModel(makeModel(shape), options);
}

} // namespace

TEST_CASE("nanovdb finds every anchor's cell where the model has the anchor")
{
    const Written written = writeOctree(3000, 700);
    const GscView& view = written.view;
    for (uint32_t l = 0; l < view.levels.size(); ++l) {
        const LevelRecord& level = view.levels[l];
        const auto* grid =
            reinterpret_cast<const nanovdb::NanoGrid<nanovdb::ValueMask>*>(view.nanovdb.data() + level.nanovdb_offset);
        REQUIRE(grid->gridType() == nanovdb::GridType::Mask);
        CHECK(std::string(grid->gridName()) == "level_" + std::to_string(level.level));
        const double width = double(level.quantum) * double(1u << level.cell_log2);
        const auto accessor = grid->getAccessor();
        std::set<std::array<int, 3>> cells;
        for (uint64_t c = level.chunk_first; c < level.chunk_first + level.chunk_count; ++c)
            for (uint32_t i = 0; i < view.chunks[c].anchor_count; ++i) {
                float position[3];
                storedPosition(view, view.chunks[c], i, position);
                // world space of the grid is that of the model: the anchor lies in the voxel round its index position
                const auto index =
                    grid->worldToIndex(nanovdb::Vec3R(double(position[0]), double(position[1]), double(position[2])));
                const nanovdb::Coord cell(int(std::lround(index[0])), int(std::lround(index[1])),
                                          int(std::lround(index[2])));
                REQUIRE(accessor.isActive(cell));
                cells.insert({cell[0], cell[1], cell[2]});
            }
        CHECK(grid->activeVoxelCount() == cells.size());
        CHECK(grid->voxelSize()[0] == doctest::Approx(width));
        CHECK_FALSE(accessor.isActive(nanovdb::Coord(1 << 20, 5, 5)));
    }
}

TEST_CASE("a changed byte of a grid is noticed and followed nowhere")
{
    const Written written = writeOctree(400, 100);
    GscView view = written.view;
    std::vector<std::byte> copy(view.nanovdb.begin(), view.nanovdb.end());
    // an exact heap block that starts off alignment: the sanitizer sees a byte too many
    view.nanovdb = copy;
    int reported = 0;
    const IssueSink sink = [&](const Issue& issue) {
        ++reported;
        CHECK(issue.info->severity == Severity::Error);
        CHECK(issue.pointer.find("/levels/") == 0);
    };
    CHECK(checkNanoVdb(view, sink));
    REQUIRE(reported == 0);
    const size_t dense = 4000; // grid, tree, root and the start of the first upper node
    for (size_t i = 0; i < copy.size(); i += i < dense ? 29 : 14747) {
        const std::byte before = copy[i];
        copy[i] ^= std::byte{0x41};
        CAPTURE(i);
        reported = 0;
        CHECK_FALSE(checkNanoVdb(view, sink));
        CHECK(reported > 0);
        (void)locate(view, {0, 0, 0}, sink);
        copy[i] = before;
    }
}

TEST_CASE("a leaf with another ordinal and anchors in another cell are noticed")
{
    const Written written = writeOctree(400, 100);
    std::string names;
    const IssueSink sink = [&](const Issue& issue) { names += std::string(issue.info->name) + " "; };

    GscView swapped = written.view;
    std::vector<LeafRecord> leaves(swapped.leaves.begin(), swapped.leaves.end());
    REQUIRE(leaves.size() > 2);
    std::swap(leaves[0].nanovdb_index, leaves[1].nanovdb_index);
    swapped.leaves = leaves;
    CHECK_FALSE(checkNanoVdb(swapped, sink));
    CHECK(names.find("GridLeaf GridLeaf ") == 0);

    GscView moved = written.view;
    std::vector<std::byte> anchors(moved.anchors.begin(), moved.anchors.end());
    moved.anchors = anchors;
    GridPosition position;
    std::memcpy(&position, anchors.data(), sizeof(position));
    position.local[0] = uint16_t(position.local[0] ^ (1u << moved.levels[0].cell_log2));
    std::memcpy(anchors.data(), &position, sizeof(position));
    names.clear();
    CHECK_FALSE(checkNanoVdb(moved, sink));
    CHECK(names.find("GridCells") != std::string::npos);
}
