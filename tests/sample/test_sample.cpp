// SPDX-License-Identifier: Apache-2.0
// Output of makeSample: the same bytes every time, the anchors asked for, and a model that cannot be told from one a
// trainer left.
#include "convert/input/checkpoint.h"
#include "convert/survey/grid_fit.h"
#include <gsc/gsc_layout.h>
#include "sample/sample_tools.h"

#include <doctest/doctest.h>
#include <tbb/global_control.h>

#include <array>
#include <cmath>
#include <cstring>
#include <map>
#include <set>

using namespace gsc;
using namespace gsc::test;

namespace {

constexpr SampleScene kScenes[] = {SampleScene::City, SampleScene::Street, SampleScene::Room};
constexpr SampleModel kModels[] = {SampleModel::Scaffold, SampleModel::Octree};

// Every anchor reproduced by the trainers' arithmetic; how many share their cell.
size_t checkGrid(const Checkpoint& checkpoint, const PlyRows& ply, bool octree, int32_t& shared_level)
{
    std::vector<GridSample> samples;
    for (size_t i = 0; i < ply.count(); ++i)
        for (size_t axis = 0; axis < 3; ++axis)
            samples.push_back({ply.at(i, axis), octree ? int32_t(ply.at(i, 3)) : 0});
    const std::optional<Grid> grid = fitGrid(samples, {checkpoint.voxel_size, checkpoint.fork, octree});
    REQUIRE(grid.has_value());
    CHECK(grid->voxel_size == checkpoint.voxel_size);
    std::set<std::array<int32_t, 4>> cells;
    size_t shared = 0;
    shared_level = -1;
    for (size_t i = 0; i < ply.count(); ++i) {
        const int32_t level = octree ? int32_t(ply.at(i, 3)) : 0;
        const float quantum = levelQuantum(grid->voxel_size, checkpoint.fork, level);
        std::array<int32_t, 4> cell{0, 0, 0, level};
        for (size_t axis = 0; axis < 3; ++axis) {
            const auto point = locateOnGrid(ply.at(i, axis), quantum, grid->origin);
            if (!point || point->negative_zero)
                FAIL("off the grid: row " << i);
            cell[axis] = point->quanta;
        }
        if (!cells.insert(cell).second) {
            ++shared;
            shared_level = level;
        }
    }
    return shared;
}

} // namespace

TEST_CASE("sample: the same options give the same bytes, on one thread and on two")
{
    const TemporaryFolder scratch;
    for (const SampleModel model : kModels) {
        SampleOptions options = sampleOptions(SampleScene::City, model, 6000, scratch / "first");
        options.everything_on = true;
        options.overwrite = true;
        makeSample(options, {});
        const auto first = hashFolder(options.output);
        CHECK(first.size() == 21); // cfg_args, cameras.json, metre.json, PLY, four MLPs, embedding, twelve paths
        {
            const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
            options.output = scratch / "second";
            makeSample(options, {});
        }
        CHECK(hashFolder(options.output) == first);
        options.seed = 2;
        makeSample(options, {});
        const auto other = hashFolder(options.output);
        for (const auto& [name, hash] : first)
            if (name.ends_with(".ply"))
                CHECK(other.at(name) != hash);
    }
}

TEST_CASE("sample: exactly the anchors asked for")
{
    const TemporaryFolder scratch;
    for (const SampleScene scene : kScenes)
        for (const SampleModel model : kModels)
            for (const uint64_t anchors : {1u, 2u, 10u, 129u, 12'345u}) {
                if (anchors == 1 && model == SampleModel::Octree)
                    continue;
                CAPTURE(int(scene));
                CAPTURE(int(model));
                CAPTURE(anchors);
                SampleOptions options = sampleOptions(scene, model, anchors, scratch / "model");
                options.overwrite = true;
                uint64_t last = 0;
                const SampleReport report = makeSample(options, [&](const char*, uint64_t done, uint64_t total) {
                    CHECK(done >= last);
                    CHECK(total == anchors);
                    last = done;
                });
                CHECK(last == anchors);
                CHECK(report.anchors == anchors);
                const auto ply = plyOf(options.output);
                CHECK(report.ply_bytes == std::filesystem::file_size(ply));
                const PlyRows rows = readPlyRows(ply);
                CHECK(rows.count() == anchors);
                bool finite = true;
                for (const float value : rows.values)
                    finite &= std::isfinite(value);
                CHECK(finite);
            }
    // rows 0 and 1 of an Octree-GS file carry voxel_size and standard_dist: one row is not enough
    const Outcome failure = tryMake(sampleOptions(SampleScene::City, SampleModel::Octree, 1, scratch / "one"));
    CHECK(failure.code == ErrorCode::Usage);
    CHECK(failure.message.find("expected 2") != std::string::npos);
    CHECK(tryMake(sampleOptions(SampleScene::City, SampleModel::Scaffold, 0, scratch / "none")).code ==
          ErrorCode::Usage);
    CHECK(scratch.names().size() == 1);
}

TEST_CASE("sample: positions lie on the trainers' grid bit for bit, in cells of their own")
{
    const TemporaryFolder scratch;
    for (const SampleScene scene : kScenes)
        for (const SampleModel model : kModels) {
            CAPTURE(int(scene));
            CAPTURE(int(model));
            const bool octree = model == SampleModel::Octree;
            const std::string folder = scratch / ("grid" + std::to_string(int(scene)) + std::to_string(int(model)));
            makeSample(sampleOptions(scene, model, 60'000, folder), {});
            const Checkpoint checkpoint = readCheckpoint(folder, {});
            const PlyRows ply = readPlyRows(plyOf(folder));
            int32_t shared_level = -1;
            const size_t shared = checkGrid(checkpoint, ply, octree, shared_level);
            if (octree) { // trap 12: a small share of the finest level lies in taken cells
                CHECK(shared > ply.count() / 400);
                CHECK(shared < ply.count() / 40);
                CHECK(shared_level == checkpoint.level_clamp);
            } else {
                CHECK(shared == 0);
            }
        }
}

TEST_CASE("sample: the checkpoint reader finds nothing to remark on")
{
    const TemporaryFolder scratch;
    for (const bool everything_on : {false, true})
        for (const SampleModel model : kModels) {
            CAPTURE(everything_on);
            CAPTURE(int(model));
            const bool octree = model == SampleModel::Octree;
            SampleOptions options = sampleOptions(SampleScene::City, model, 20'000, scratch / "model");
            options.overwrite = true;
            options.everything_on = everything_on;
            makeSample(options, {});
            const Checkpoint cp = readCheckpoint(options.output, {});
            CHECK(cp.warnings.empty());
            CHECK(cp.family == (octree ? ModelFamily::OctreeGs : ModelFamily::ScaffoldGs));
            CHECK(cp.container == "split");
            CHECK(cp.iteration == (octree ? 40'000 : 30'000));
            CHECK(cp.anchor_count == 20'000);
            CHECK(cp.feat_dim == 32);
            CHECK(cp.n_offsets == 10);
            REQUIRE(cp.mlps.size() == (everything_on ? 4 : 3));
            const uint32_t common = 35 + (everything_on ? 1 : 0) + (everything_on && octree ? 1 : 0);
            const uint32_t widths[] = {common, common, common + (everything_on ? 32u : 0u), everything_on ? 4u : 0u};
            const uint32_t outputs[] = {10, 70, 30, 3};
            for (size_t i = 0; i < cp.mlps.size(); ++i) {
                CHECK(cp.mlps[i].kind == MlpKind(i));
                CHECK(cp.mlps[i].layers[0].in == widths[i]);
                CHECK(cp.mlps[i].layers[0].out == 32);
                CHECK(cp.mlps[i].layers[1].out == outputs[i]);
            }
            size_t held_out = 0;
            for (size_t i = 0; i < cp.cameras.size(); ++i) {
                held_out += cp.cameras[i].is_test;
                CHECK(cp.cameras[i].is_test == (i < (cp.cameras.size() + 7) / 8));
            }
            CHECK(cp.cameras.size() >= 64);
            CHECK(held_out == (cp.cameras.size() + 7) / 8);
            CHECK(cp.appearance_dim == (everything_on ? 32 : 0));
            CHECK(cp.embedding.size() == (everything_on ? (cp.cameras.size() - held_out) * 32 : 0));
            CHECK(cp.level_rule == (!octree ? LevelRule::None : everything_on ? LevelRule::Floor : LevelRule::Round));

            const PlyRows ply = readPlyRows(plyOf(options.output));
            const auto anchors = openAnchors(cp);
            AnchorBatch batch;
            size_t row = 0, different = 0;
            while (anchors->next(batch, kAnchorAll, 7'000))
                for (size_t i = 0; i < batch.count; ++i, ++row) {
                    different += std::memcmp(&batch.position[3 * i], &ply.values[row * ply.columns.size()], 12) != 0;
                    for (size_t k = 0; k < 10; ++k)
                        for (size_t axis = 0; axis < 3; ++axis) // axis-major in the file (trap 6)
                            different += batch.offset[i * 30 + k * 3 + axis] != ply.at(row, 6 + axis * 10 + k);
                }
            CHECK(row == 20'000);
            CHECK(different == 0);
        }
}

TEST_CASE("sample: columns hold what training leaves in them")
{
    const TemporaryFolder scratch;
    makeSample(sampleOptions(SampleScene::City, SampleModel::Octree, 60'000, scratch / "octree"), {});
    makeSample(sampleOptions(SampleScene::City, SampleModel::Scaffold, 20'000, scratch / "scaffold"), {});
    std::set<float> sums = {0.0f}; // extra_level is an fp32 running sum (trap 29)
    for (float sum = 0; sums.size() < 400;)
        sums.insert(sum += 0.01f);
    for (const char* name : {"octree", "scaffold"}) {
        const PlyRows ply = readPlyRows(plyOf(scratch / name));
        const bool octree = ply.columns[3] == "level";
        CHECK(ply.columns.size() == 79);
        const size_t opacity = ply.column("opacity"), scale = ply.column("scale_0"), rot = ply.column("rot_0");
        std::map<float, size_t> levels;
        size_t biased = 0, wrong = 0;
        for (size_t i = 0; i < ply.count(); ++i) {
            if (octree) {
                ++levels[ply.at(i, 3)];
                biased += ply.at(i, 4) > 0;
                wrong += sums.count(ply.at(i, 4)) != 1;
                wrong += (ply.at(i, 5) != 0) != (i < 2);
            } else {
                wrong += ply.at(i, 3) != 0 || ply.at(i, 4) != 0 || ply.at(i, 5) != 0; // normals
            }
            wrong += ply.at(i, opacity) != -2.1972246f || ply.at(i, rot) != 1;
            wrong += ply.at(i, rot + 1) != 0 || ply.at(i, rot + 2) != 0 || ply.at(i, rot + 3) != 0;
            for (size_t j = 0; j < 6; ++j)
                wrong += !(std::abs(ply.at(i, scale + j)) < 9);
        }
        CHECK(wrong == 0);
        if (octree) {
            CHECK(levels.size() == 3);
            CHECK(levels.begin()->first == 0);
            CHECK(levels[2] > levels[1]);
            CHECK(biased > ply.count() / 20);
            CHECK(ply.at(1, 5) > ply.at(0, 5)); // standard_dist is the larger
        }
    }
}
