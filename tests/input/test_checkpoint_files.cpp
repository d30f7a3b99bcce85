// SPDX-License-Identifier: Apache-2.0
// Where the files of a model are, and the anchors in them.
#include "convert/input/checkpoint.h"
#include "tests/input/model_fixture.h"

#include <doctest/doctest.h>

#include <algorithm>

using namespace gsc;
using namespace gsc::test;

namespace fs = std::filesystem;

TEST_CASE("checkpoint: every way to name a model finds the same files")
{
    const TemporaryFolder folder;
    ModelSpec spec;
    const fs::path old = writeModel(folder.path() / "m", spec);
    spec.iteration = 30;
    const fs::path latest = writeModel(folder.path() / "m", spec);
    writeFile(folder.path() / "m/point_cloud/notes.txt", std::string("foreign"));
    writeFile(folder.path() / "m/input.ply", std::string("ply\n"));
    for (const fs::path& path : {folder.path() / "m", folder.path() / "m/", folder.path() / "m/point_cloud", latest,
                                 latest / "point_cloud.ply", folder.path() / "m/point_cloud/../."}) {
        CAPTURE(path.string());
        const Checkpoint checkpoint = read(path);
        CHECK(checkpoint.iteration == 30);
        CHECK(fs::equivalent(checkpoint.ply_path, latest / "point_cloud.ply"));
        CHECK(checkpoint.voxel_size == 0.25f); // cfg_args was found
        CHECK(checkpoint.model_path == path.string());
    }
    CHECK(warns(read(folder.path() / "m"), "notes.txt"));
    CHECK(read(old).iteration == 7);
    CheckpointOptions options;
    options.iteration = 7;
    CHECK(read(folder.path() / "m", options).iteration == 7);
    options.iteration = 8;
    const Outcome missing = outcomeOf([&] { (void)read(folder.path() / "m", options); });
    CHECK(missing.code == ErrorCode::Usage);
    CHECK(missing.says("found 7, 30"));
    CHECK(outcomeOf([&] { (void)read(latest, options); }).code == ErrorCode::Usage);

    // files directly in one folder, and directly in point_cloud/
    fs::copy(latest, folder.path() / "flat");
    CHECK(read(folder.path() / "flat").iteration == -1);
    CHECK(warns(read(folder.path() / "flat"), "cfg_args: not found"));
    options = {};
    options.scene_dir = (folder.path() / "m").string();
    CHECK(read(folder.path() / "flat", options).voxel_size == 0.25f);
    CHECK_FALSE(warns(read(folder.path() / "m", options), "is not read")); // it is the same file
    fs::copy(folder.path() / "m/cfg_args", folder.path() / "flat/cfg_args");
    CHECK(warns(read(folder.path() / "flat", options), "m/cfg_args: is not read, because"));
    fs::remove(folder.path() / "flat/cfg_args");
    fs::create_directories(folder.path() / "viewer");
    fs::copy(latest, folder.path() / "viewer/point_cloud");
    fs::copy(folder.path() / "m/cfg_args", folder.path() / "viewer/cfg_args");
    CHECK(read(folder.path() / "viewer").voxel_size == 0.25f);
    fs::rename(folder.path() / "flat/point_cloud.ply", folder.path() / "flat/castle.ply");
    CHECK(read(folder.path() / "flat/castle.ply").anchor_count == 5);
}

TEST_CASE("checkpoint, traps 7 and 12: anchors come in file order, equal ones stay, opacity is carried only")
{
    const TemporaryFolder folder;
    ModelSpec spec;
    spec.columns = Columns::Octree;
    spec.rows = 2000;
    const fs::path iteration = writeModel(folder.path(), spec);
    PlyText ply = makePly(Columns::Octree, spec.rows, spec.n_offsets, spec.feat_dim);
    for (size_t row = 100; row < 228; ++row) // 128 anchors in one cell
        for (const char* column : {"x", "y", "z", "level"})
            ply.at(row, column) = ply.at(100, column);
    writeFile(iteration / "point_cloud.ply", ply.text());
    const Checkpoint checkpoint = read(folder.path());
    CHECK(checkpoint.anchor_count == 2000);
    const std::unique_ptr<AnchorSource> source = openAnchors(checkpoint);
    for (const size_t max_rows : {1, 7, 1999, 2000, 100000}) {
        CAPTURE(max_rows);
        source->rewind();
        AnchorBatch batch;
        uint64_t row = 0;
        while (source->next(batch, kAnchorAll, max_rows)) {
            REQUIRE(batch.first == row);
            REQUIRE(batch.count == std::min<uint64_t>(max_rows, 2000 - row));
            for (size_t i = 0; i < batch.count; ++i, ++row) {
                REQUIRE(batch.position[3 * i + 1] == ply.at(row, "y"));
                REQUIRE(batch.scale[6 * i + 5] == ply.at(row, "scale_5"));
                REQUIRE(batch.opacity[i] == ply.at(row, "opacity"));
                REQUIRE(batch.rotation[4 * i] == ply.at(row, "rot_0"));
                REQUIRE(batch.offset[6 * i + 3] == ply.at(row, "f_offset_1")); // k = 1, x
            }
        }
        CHECK(row == 2000);
        CHECK_FALSE(source->next(batch, kAnchorPlacement, max_rows));
        CHECK(batch.count == 0);
    }
    // the file is not the one that was read any more
    writeFile(iteration / "point_cloud.ply", makePly(Columns::Octree, 9, spec.n_offsets, spec.feat_dim).text());
    CHECK(outcomeOf([&] { (void)openAnchors(checkpoint); }).code == ErrorCode::Io);
}
