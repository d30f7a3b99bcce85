// SPDX-License-Identifier: Apache-2.0
// The exported grids as NanoVDB and OpenVDB read them.
#include "convert/grids/grid_files.h"
#include "tests/write/memory_model.h"

#include <doctest/doctest.h>

#include <openvdb/io/Stream.h>
#include <openvdb/openvdb.h>
#include <nanovdb/util/IO.h>

#include <cmath>
#include <cstring>
#include <sstream>

using namespace gsc;
using namespace gsc::test;

namespace {

const IssueSink kNoIssue = [](const Issue& issue) { FAIL(issue.info->name); };

Written writeLevels()
{
    ModelShape shape;
    shape.anchors = 3000;
    shape.levels = 2;
    shape.origin = -5.3f;
    shape.spread = 700;
    WriteOptions options;
    options.chunk_anchors = 200;
    return writeModel(makeModel(shape), options);
}

std::string exported(const GscView& view, GridFileFormat format, std::vector<ExportedGrid>& grids)
{
    std::string bytes;
    grids = writeGridFile(view, format, kNoIssue, [&](std::string_view piece) { bytes += piece; });
    REQUIRE(grids.size() == view.levels.size());
    for (size_t l = 0; l < grids.size(); ++l) {
        CHECK(grids[l].level == view.levels[l].level);
        CHECK(grids[l].leaves == view.levels[l].leaf_count);
        CHECK(grids[l].voxel_size ==
              doctest::Approx(double(view.levels[l].quantum) * double(1u << view.levels[l].cell_log2)));
    }
    std::vector<ExportedGrid> again;
    std::string second;
    writeGridFile(view, format, kNoIssue, [&](std::string_view piece) { second += piece; });
    CHECK(second == bytes);
    return bytes;
}

} // namespace

TEST_CASE("a NanoVDB file: NanoVDB reads the stored grids from it, byte for byte")
{
    const Written written = writeLevels();
    std::vector<ExportedGrid> grids;
    std::istringstream file(exported(written.view, GridFileFormat::NanoVdb, grids));
    nanovdb::io::Segment head;
    REQUIRE(head.read(file));
    REQUIRE(head.meta.size() == grids.size());
    for (size_t l = 0; l < grids.size(); ++l) {
        CHECK(head.meta[l].gridName == grids[l].name);
        CHECK(head.meta[l].voxelCount == grids[l].voxels);
        CHECK(head.meta[l].nodeCount[0] == grids[l].leaves);
        CHECK(head.meta[l].gridType == nanovdb::GridType::Mask);
        file.seekg(0);
        const auto handle = nanovdb::io::readGrid(file, l);
        const LevelRecord& level = written.view.levels[l];
        REQUIRE(handle.size() == level.nanovdb_bytes);
        CHECK(std::memcmp(handle.data(), written.view.nanovdb.data() + level.nanovdb_offset, handle.size()) == 0);
    }
}

TEST_CASE("an OpenVDB file: its masks hold the cells of all anchors, where the model has them, and no others")
{
    openvdb::initialize();
    const Written written = writeLevels();
    const GscView& view = written.view;
    std::vector<ExportedGrid> grids;
    std::istringstream file(exported(view, GridFileFormat::OpenVdb, grids));
    openvdb::io::Stream stream(file);
    const openvdb::GridPtrVecPtr read = stream.getGrids();
    REQUIRE(read->size() == grids.size());
    for (size_t l = 0; l < grids.size(); ++l) {
        const auto mask = openvdb::gridPtrCast<openvdb::MaskGrid>((*read)[l]);
        REQUIRE(mask);
        CHECK(mask->getName() == grids[l].name);
        CHECK(mask->activeVoxelCount() == grids[l].voxels);
        CHECK(mask->tree().leafCount() == grids[l].leaves);
        const LevelRecord& level = view.levels[l];
        auto accessor = mask->getConstAccessor();
        for (uint64_t c = level.chunk_first; c < level.chunk_first + level.chunk_count; ++c)
            for (uint32_t i = 0; i < view.chunks[c].anchor_count; ++i) {
                float p[3];
                storedPosition(view, view.chunks[c], i, p);
                const openvdb::Vec3d at{double(p[0]), double(p[1]), double(p[2])};
                REQUIRE(accessor.isValueOn(mask->transform().worldToIndexCellCentered(at)));
            }
    }
}

TEST_CASE("a grid that leads out of itself is reported, and no byte is written")
{
    const Written written = writeLevels();
    GscView view = written.view;
    std::vector<std::byte> copy(view.nanovdb.begin(), view.nanovdb.end());
    copy[view.levels[1].nanovdb_offset + 700] ^= std::byte{0x41}; // number of nodes
    view.nanovdb = copy;
    for (const GridFileFormat format : {GridFileFormat::NanoVdb, GridFileFormat::OpenVdb}) {
        int reported = 0;
        const auto grids = writeGridFile(
            view, format, [&](const Issue&) { ++reported; }, [](std::string_view) { FAIL("written"); });
        CHECK(reported == 1);
        CHECK(grids.empty());
    }
}
