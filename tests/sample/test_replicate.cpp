// SPDX-License-Identifier: Apache-2.0
// Tiling a model into a city. The sample city stands in for a real aerial model where there is none.
#include "convert/input/checkpoint.h"
#include "convert/survey/grid_fit.h"
#include <gsc/error.h>
#include <gsc/gsc_layout.h>
#include "runtime/cameras/camera_file.h"
#include "sample/sample_tools.h"
#include "support/checkpoints.h"
#include "tests/support/source_folder.h"

#include <doctest/doctest.h>

#include <cmath>
#include <cstring>
#include <map>
#include <string>

using namespace gsc;
using namespace gsc::test;

namespace {

ReplicateOptions replicateOptions(const std::string& input, uint64_t anchors, const std::string& output)
{
    ReplicateOptions options;
    options.input = input;
    options.anchors = anchors;
    options.output = output;
    return options;
}

Grid gridOf(const Checkpoint& checkpoint, const PlyRows& ply, bool octree)
{
    std::vector<GridSample> samples;
    for (size_t i = 0; i < ply.count(); ++i)
        for (size_t axis = 0; axis < 3; ++axis)
            samples.push_back({ply.at(i, axis), octree ? int32_t(ply.at(i, 3)) : 0});
    const std::optional<Grid> grid = fitGrid(samples, {checkpoint.voxel_size, checkpoint.fork, octree});
    REQUIRE(grid.has_value());
    return *grid;
}

// Everything but the place and `info` of a row.
std::string rowKey(const PlyRows& ply, size_t row, bool octree)
{
    std::string key(reinterpret_cast<const char*>(&ply.values[row * ply.columns.size() + 3]),
                    (ply.columns.size() - 3) * sizeof(float));
    if (octree)
        std::memset(&key[2 * sizeof(float)], 0, sizeof(float));
    return key;
}

void checkCity(const std::string& model, const std::string& city, uint64_t anchors, const SampleReport& report)
{
    CHECK(report.anchors == anchors);
    const Checkpoint source = readCheckpoint(model, {});
    const Checkpoint result = readCheckpoint(city, {});
    const bool octree = source.family == ModelFamily::OctreeGs;
    CHECK(result.family == source.family);
    CHECK(result.anchor_count == anchors);
    CHECK(result.cfg_args == source.cfg_args);
    REQUIRE(result.mlps.size() == source.mlps.size());
    for (size_t i = 0; i < source.mlps.size(); ++i)
        CHECK(result.mlps[i].layers[0].weight == source.mlps[i].layers[0].weight);
    CHECK(result.standard_dist == source.standard_dist);
    CHECK(result.voxel_size == source.voxel_size);

    const PlyRows from = readPlyRows(source.ply_path), to = readPlyRows(result.ply_path);
    CHECK(to.count() == anchors);
    CHECK(to.columns == from.columns);
    const Grid grid = gridOf(source, from, octree);
    std::map<std::string, size_t> rows;
    for (size_t i = 0; i < from.count(); ++i)
        rows[rowKey(from, i, octree)] = i;
    size_t copies_of_first = 0, on_grid = 0, known = 0;
    const std::string first = rowKey(to, 0, octree);
    for (size_t i = 0; i < to.count(); ++i) {
        const std::string key = rowKey(to, i, octree);
        known += rows.count(key);
        copies_of_first += key == first;
        const float quantum = levelQuantum(grid.voxel_size, source.fork, octree ? int32_t(to.at(i, 3)) : 0);
        size_t axes = 0;
        for (size_t axis = 0; axis < 3; ++axis)
            axes += locateOnGrid(to.at(i, axis), quantum, grid.origin).has_value();
        on_grid += axes == 3;
        if (octree && i > 1)
            CHECK(to.at(i, 5) == 0);
    }
    CHECK(known == anchors); // only place differs from a source row
    CHECK(on_grid == anchors);
    CHECK(copies_of_first == report.tiles);

    const std::vector<Camera> path = readCameraFile(report.path_file);
    REQUIRE(path.size() == 40);
    CHECK(path[0].width == 2048);
    CHECK(path[0].height == 2048);
    CHECK(path[0].fov_x == doctest::Approx(1.5707963));
    CHECK(result.cameras.size() == 40);
    CHECK(readText(report.path_file).find("\"ipd\"") != std::string::npos);
}

} // namespace

TEST_CASE("replicate: the sample city, tiled")
{
    const TemporaryFolder scratch;
    for (const SampleModel model : {SampleModel::Scaffold, SampleModel::Octree}) {
        CAPTURE(int(model));
        const std::string input = scratch / ("city" + std::to_string(int(model)));
        makeSample(sampleOptions(SampleScene::City, model, 8000, input), {});
        ReplicateOptions options = replicateOptions(input, 12'345, scratch / ("tiled" + std::to_string(int(model))));
        const SampleReport report = replicateCheckpoint(options, {});
        checkCity(input, options.output, 12'345, report);
        const auto first = hashFolder(options.output);
        options.overwrite = true;
        replicateCheckpoint(options, {});
        CHECK(hashFolder(options.output) == first);
        options.seed = 5;
        replicateCheckpoint(options, {});
        CHECK(hashFolder(options.output) != first);
    }
}

TEST_CASE("replicate: real aerial models")
{
    const TemporaryFolder scratch;
    for (const std::string& model : trainedModels()) {
        if (model.find("boruszyn") == std::string::npos)
            continue;
        CAPTURE(model);
        const ReplicateOptions options = replicateOptions(model, 150'001, scratch / "city");
        checkCity(model, options.output, 150'001, replicateCheckpoint(options, {}));
        std::filesystem::remove_all(options.output);
    }
}

TEST_CASE("replicate: a model without cameras is refused")
{
    const TemporaryFolder scratch;
    const std::string input = scratch / "model";
    makeSample(sampleOptions(SampleScene::City, SampleModel::Scaffold, 3000, input), {});
    std::filesystem::remove(input + "/cameras.json");
    const Outcome failure = tryReplicate(replicateOptions(input, 5000, scratch / "city"));
    CHECK(failure.code == ErrorCode::Usage);
    CHECK(failure.message.find("cameras.json") != std::string::npos);
    CHECK(tryReplicate(replicateOptions(scratch / "nothing", 5000, scratch / "city")).code == ErrorCode::Io);
    CHECK(tryReplicate(replicateOptions(input, 1, scratch / "city")).code == ErrorCode::Usage);
    CHECK(tryReplicate(replicateOptions(input, 5000, input)).code == ErrorCode::Usage);
    CHECK(scratch.names().size() == 1);
}

TEST_CASE("replicate: the source is never replaced")
{
    const TemporaryFolder scratch;
    const std::string input = scratch / "model";
    makeSample(sampleOptions(SampleScene::City, SampleModel::Scaffold, 3000, input), {});
    const auto before = hashFolder(input);
    std::filesystem::create_directory_symlink(input, scratch / "link");
    std::filesystem::create_directory(scratch / "other");
    std::filesystem::create_directory_symlink(input + "/point_cloud", scratch / "other/point_cloud");
    std::filesystem::copy_file(input + "/cameras.json", scratch / "other/cameras.json");
    std::filesystem::copy_file(input + "/cfg_args", scratch / "other/cfg_args");
    const std::string same[][2] = {{input, input},
                                   {input, input + "/"},
                                   {input, input + "/point_cloud/.."},
                                   {input, scratch / "link"},
                                   {scratch / "link", input},
                                   {scratch / "other", input}, // its point_cloud is the model's
                                   {input, scratch.path().string()}};
    for (const auto& pair : same)
        for (const bool overwrite : {false, true}) {
            const std::string &from = pair[0], &to = pair[1];
            CAPTURE(from);
            CAPTURE(to);
            ReplicateOptions options = replicateOptions(from, 5000, to);
            options.overwrite = overwrite;
            const Outcome failure = tryReplicate(options);
            CHECK(failure.code == ErrorCode::Usage);
            if (overwrite && to != scratch.path().string())
                CHECK(failure.message.find("holds the source") != std::string::npos);
        }
    CHECK(hashFolder(input) == before);
    CHECK(scratch.names().size() == 3);
}

TEST_CASE("sample paths: every trajectory in samples/paths is one the player reads")
{
    size_t files = 0;
    for (const auto& entry : std::filesystem::directory_iterator(sourceFolder() + "/samples/paths")) {
        CAPTURE(entry.path().string());
        TrajectoryFacts facts; // one has the eyes of a headset
        const std::vector<Camera> cameras = readCameraFile(entry.path().string(), &facts);
        CHECK(cameras.size() >= 24);
        for (const Camera& camera : cameras)
            CHECK(camera.width > 0);
        ++files;
    }
    CHECK(files >= 4);
}
