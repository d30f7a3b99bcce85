// SPDX-License-Identifier: Apache-2.0
#include "convert/input/checkpoint.h"
#include "convert/input/torch/torch_archive.h"
#include "tests/input/model_fixture.h"
#include "tests/support/checkpoints.h"

#include <doctest/doctest.h>

#include <cmath>
#include <fstream>
#include <iterator>
#include <set>

using namespace gsc;
using namespace gsc::test;

namespace {

struct Expected {
    const char* name;
    ModelFamily family;
    uint64_t anchors;
    int iteration;
    LevelRule rule;
    int32_t clamp;
    uint32_t flags, appearance;
    uint32_t inputs[3];
    float voxel;
    size_t cameras, held_out;
};

constexpr uint32_t kAll = kMlpTakesFeature | kMlpTakesDistance, kLevel = kAll | kMlpTakesLevel;
constexpr uint32_t kOctree = kModelHasLevels | kModelLodHalfCell;

// From each model's README row, cfg_args and `head` of the PLY, not from this reader.
constexpr Expected kExpected[] = {
    {"boruszyn_octree", ModelFamily::OctreeGs, 114845, 10000, LevelRule::Round, 3, kOctree, 0, {1, 1, 1}, 0, 28, 4},
    {"boruszyn_scaffold", ModelFamily::ScaffoldGs, 63005, 10000, LevelRule::None, 0, 0, 0, {1, 1, 1}, 0.01f, 28, 4},
    {"fox_octree", ModelFamily::OctreeGs, 51096, 10000, LevelRule::Round, 2, kOctree, 0, {1, 1, 1}, 0, 50, 7},
    {"fox_octree_all",
     ModelFamily::OctreeGs,
     25506,
     1500,
     LevelRule::Floor,
     1,
     kOctree | kModelFeatureBank | kModelBankLevel,
     32,
     {kLevel, kLevel, kLevel | kMlpTakesAppearance},
     0,
     50,
     7},
    {"fox_scaffold", ModelFamily::ScaffoldGs, 26056, 10000, LevelRule::None, 0, 0, 0, {1, 1, 1}, 0.005f, 50, 7},
    {"fox_scaffold_all",
     ModelFamily::ScaffoldGs,
     17389,
     1500,
     LevelRule::None,
     0,
     kModelFeatureBank | kModelBankDistance,
     32,
     {kAll, kAll, kAll | kMlpTakesAppearance},
     0.005f,
     50,
     7},
};

const Expected* expectedOf(const std::string& model)
{
    for (const Expected& expected : kExpected)
        if (model.ends_with(std::string("/") + expected.name))
            return &expected;
    return nullptr;
}

std::string slurp(const std::string& path)
{
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
}

} // namespace

TEST_CASE("trained models: everything but the anchors is what the trainer says it is")
{
    for (const std::string& model : trainedModels()) {
        CAPTURE(model);
        const Expected* expected = expectedOf(model);
        REQUIRE(expected);
        const Checkpoint checkpoint = readCheckpoint(model, {});
        CHECK(checkpoint.family == expected->family);
        CHECK(checkpoint.container == "split");
        CHECK(checkpoint.iteration == expected->iteration);
        CHECK(checkpoint.anchor_count == expected->anchors);
        CHECK(checkpoint.feat_dim == 32);
        CHECK(checkpoint.n_offsets == 10);
        CHECK(checkpoint.level_rule == expected->rule);
        CHECK(checkpoint.level_min == 0);
        CHECK(checkpoint.level_clamp == expected->clamp);
        CHECK(checkpoint.flags == expected->flags);
        CHECK(checkpoint.appearance_dim == expected->appearance);
        CHECK(checkpoint.warnings.empty());
        for (int i = 0; i < 3; ++i)
            CHECK(checkpoint.mlps[size_t(i)].inputs == expected->inputs[i]);
        if (expected->voxel != 0)
            CHECK(checkpoint.voxel_size == expected->voxel);
        else
            CHECK(checkpoint.standard_dist > 10 * checkpoint.voxel_size);
        REQUIRE(checkpoint.cameras.size() == expected->cameras);
        for (size_t i = 0; i < expected->cameras; ++i) {
            const SourceCamera& camera = checkpoint.cameras[i];
            CHECK(camera.is_test == (i < expected->held_out));
            const int row = int(i < expected->held_out ? i : i - expected->held_out);
            CHECK(camera.appearance == (expected->appearance ? row : -1));
        }
        if (expected->appearance)
            CHECK(checkpoint.embedding.size() == 32 * (expected->cameras - expected->held_out));
    }
}

TEST_CASE("trained models: anchors agree with the bytes of the PLY")
{
    for (const std::string& model : trainedModels()) {
        CAPTURE(model);
        const Checkpoint checkpoint = readCheckpoint(model, {});
        const std::string ply = slurp(checkpoint.ply_path);
        // note: the row layout is stated here once more, by hand: 79 floats in the order of the format facts, 3.1
        const float* rows = nullptr;
        std::vector<float> aligned((ply.size() - ply.find("end_header\n") - 11) / sizeof(float));
        ply.copy(reinterpret_cast<char*>(aligned.data()), aligned.size() * sizeof(float),
                 ply.find("end_header\n") + 11);
        rows = aligned.data();
        REQUIRE(aligned.size() == 79 * checkpoint.anchor_count);
        const bool octree = checkpoint.family == ModelFamily::OctreeGs;
        const std::unique_ptr<AnchorSource> source = openAnchors(checkpoint);
        AnchorBatch batch;
        uint64_t row = 0, different = 0;
        std::set<int32_t> levels;
        while (source->next(batch, kAnchorAll, 5000))
            for (size_t i = 0; i < batch.count; ++i, ++row) {
                const float* expected = rows + 79 * row;
                for (size_t c = 0; c < 3; ++c)
                    different += batch.position[3 * i + c] != expected[c];
                different += batch.level[i] != (octree ? int32_t(expected[3]) : 0);
                different += batch.extra_level[i] != (octree ? expected[4] : 0);
                for (size_t k = 0; k < 10; ++k)
                    for (size_t axis = 0; axis < 3; ++axis)
                        different += batch.offset[30 * i + 3 * k + axis] != expected[6 + 10 * axis + k];
                for (size_t c = 0; c < 32; ++c)
                    different += batch.feature[32 * i + c] != expected[36 + c];
                different += batch.opacity[i] != expected[68];
                for (size_t c = 0; c < 6; ++c)
                    different += batch.scale[6 * i + c] != expected[69 + c];
                for (size_t c = 0; c < 4; ++c)
                    different += batch.rotation[4 * i + c] != expected[75 + c];
                levels.insert(batch.level[i]);
            }
        CHECK(row == checkpoint.anchor_count);
        CHECK(different == 0);
        CHECK(levels.size() == size_t(checkpoint.level_clamp) + 1);
    }
}

TEST_CASE("trained models: every archive is written and read back bit for bit")
{
    for (const std::string& model : trainedModels()) {
        CAPTURE(model);
        const Checkpoint checkpoint = readCheckpoint(model, {});
        for (const Mlp& mlp : checkpoint.mlps) {
            const TorchArchive copy = readTorchArchive(writeTorchScriptMlp(mlp, "copy"), "copy");
            REQUIRE(copy.tensors.size() == 4);
            CHECK(copy.tensors[0].values == mlp.layers[0].weight);
            CHECK(copy.tensors[1].values == mlp.layers[0].bias);
            CHECK(copy.tensors[2].values == mlp.layers[1].weight);
            CHECK(copy.tensors[3].values == mlp.layers[1].bias);
        }
    }
}

TEST_CASE("trained models: a truncated or damaged archive of the real trainer is refused")
{
    for (const std::string& model : trainedModels()) {
        const std::string bytes = slurp(readCheckpoint(model, {}).weight_paths.front());
        const auto read = [](const std::string& text) {
            return outcomeOf([&] { (void)readTorchArchive(std::as_bytes(std::span(text)), "damaged.pt"); }).code;
        };
        REQUIRE(read(bytes) == ErrorCode::Ok);
        for (size_t size = 0; size < bytes.size(); size += 61)
            REQUIRE(read(bytes.substr(0, size)) == ErrorCode::InvalidFile);
        std::string damaged = bytes;
        damaged[100] = char(damaged[100] ^ 1); // in the first weight
        CHECK(read(damaged) == ErrorCode::InvalidFile);
    }
}
