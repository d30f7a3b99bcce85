// SPDX-License-Identifier: Apache-2.0
// Content of a file of `gsc convert`. writeModel() also requires every file here to pass the full validator and
// NanoVDB's reader.
#include "convert/compare/compare_checkpoint.h"
#include <gsc/error.h>
#include "kernels/math/lod.h"
#include "tests/write/memory_model.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <map>
#include <random>
#include <tuple>

using namespace gsc;
using namespace gsc::test;

namespace {

void checkEqual(const MemoryModel& model, const Written& written)
{
    MemorySource source(model);
    const CompareReport report = compareCheckpoint(model.checkpoint, source, written.view, {});
    INFO(report.summary());
    CHECK(report.equal);
    CHECK(report.anchors == written.view.index.size());
}

ModelShape octreeShape(uint64_t anchors)
{
    ModelShape shape;
    shape.anchors = anchors;
    shape.levels = 3;
    shape.origin = -5.3f;
    return shape;
}

// Position in the order of the file, from the positions alone and with another Morton code than the writer's.
using SortKey = std::tuple<uint32_t, std::array<uint8_t, 96>, std::array<uint8_t, 96>, uint32_t>;

std::array<uint8_t, 96> bitsFromTheTop(const int32_t c[3])
{
    std::array<uint8_t, 96> bits{};
    for (int bit = 0; bit < 32; ++bit)
        for (int axis = 0; axis < 3; ++axis)
            bits[size_t(3 * (31 - bit) + 2 - axis)] = uint8_t((uint32_t(c[axis]) ^ 0x80000000u) >> bit & 1);
    return bits;
}

} // namespace

TEST_CASE("models of any size bake, validate and compare equal")
{
    for (const uint64_t anchors : {1, 2, 3, 127, 128, 129, 1000, 5000})
        for (const bool octree : {false, true}) {
            CAPTURE(anchors);
            CAPTURE(octree);
            ModelShape shape = octree ? octreeShape(anchors) : ModelShape{};
            shape.anchors = anchors;
            const MemoryModel model = makeModel(shape);
            for (const uint64_t chunk_anchors : {1, 100, 16384}) {
                WriteOptions options;
                options.chunk_anchors = chunk_anchors;
                const Written written = writeModel(model, options);
                CHECK(written.report.exact_grid);
                CHECK(written.report.warnings.empty());
                CHECK(written.report.anchors == anchors);
                checkEqual(model, written);
            }
        }
}

TEST_CASE("the cells of a fine grid are as large as the spatial index takes them, of one too fine it says so")
{
    for (const float voxel_size : {1e-4f, 1e-5f, 5e-6f, 1e-6f, 1e-7f})
        for (const uint64_t anchors : {2, 20, 1000}) {
            CAPTURE(voxel_size);
            CAPTURE(anchors);
            ModelShape shape;
            shape.anchors = anchors;
            shape.voxel_size = voxel_size;
            const MemoryModel model = makeModel(shape);
            WriteOptions options;
            options.chunk_anchors = 1;
            checkEqual(model, writeModel(model, options));
        }
    ModelShape shape;
    shape.anchors = 1000;
    shape.voxel_size = 1e-8f;
    const MemoryModel model = makeModel(shape);
    try {
        checkEqual(model, writeModel(model, {}));
    } catch (const Error& error) {
        CHECK(error.code() == ErrorCode::Unsupported);
    }
}

TEST_CASE("every input the trainers know is stored")
{
    for (const uint32_t levels : {0, 3}) {
        ModelShape shape;
        shape.anchors = 300;
        shape.levels = levels;
        shape.feat_dim = 12;
        shape.n_offsets = 5;
        shape.appearance_dim = 9;
        shape.appearance_rows = 4;
        shape.feature_bank = shape.distance = shape.level_input = true;
        MemoryModel model = makeModel(shape);
        for (int i = 0; i < 5; ++i) {
            SourceCamera camera;
            camera.name = "IMG_" + std::to_string(i);
            camera.id = i;
            camera.width = 640;
            camera.height = 480;
            camera.rotation[0] = camera.rotation[4] = camera.rotation[8] = 1;
            camera.fx = camera.fy = 500.25;
            camera.appearance = i - 1;
            camera.is_test = i == 0;
            model.checkpoint.cameras.push_back(camera);
        }
        const Written written = writeModel(model);
        checkEqual(model, written);
        CHECK(written.view.mlps.size() == 4);
        CHECK(written.view.cameras.size() == 5);
        CHECK(written.view.embedding_rows.size() == 4);
    }
}

TEST_CASE("any number of features and offsets bakes")
{
    for (const auto& [features, offsets] :
         {std::pair<uint32_t, uint32_t>{1, 1}, {9, 2}, {10, 4}, {11, 5}, {12, 8}, {13, 9}, {32, 16}, {64, 25}}) {
        CAPTURE(features);
        ModelShape shape;
        shape.anchors = 40;
        shape.feat_dim = features;
        shape.n_offsets = offsets;
        const MemoryModel model = makeModel(shape);
        checkEqual(model, writeModel(model));
    }
}

TEST_CASE("the near plane is the rasteriser's")
{
    ModelShape shape;
    shape.anchors = 20;
    MemoryModel model = makeModel(shape);
    model.checkpoint.raster_rules = RasterRules::DiffGaussian;
    CHECK(writeModel(model).view.params->near_z == 0.2f);
    model.checkpoint.raster_rules = RasterRules::Gsplat;
    CHECK(writeModel(model).view.params->near_z == 0.01f);
}

TEST_CASE("the bytes do not depend on threads, memory or the output's name")
{
    ModelShape shape = octreeShape(20000);
    shape.spread = 3000;
    const MemoryModel model = makeModel(shape);
    WriteOptions options;
    options.chunk_anchors = 300;
    options.threads = 1;
    const Written first = writeModel(model, options);
    CHECK(first.view.chunks.size() > 20);
    for (const int threads : {2, 4, 0})
        for (const uint64_t budget : {uint64_t(0), uint64_t(1), uint64_t(200'000)}) {
            options.threads = threads;
            options.memory_budget = budget; // 1 byte: placements are read again, records are written one by one
            CHECK(writeModel(model, options).bytes() == first.bytes());
        }
    checkEqual(model, first);
}

TEST_CASE("anchors are ordered by level, leaf, cell and source index; INDX leads back")
{
    ModelShape shape = octreeShape(6000);
    shape.spread = 500;
    MemoryModel model = makeModel(shape);
    WriteOptions options;
    options.chunk_anchors = 500;
    const Written written = writeModel(model, options);
    const GscView& view = written.view;
    std::vector<SortKey> keys;
    for (const ChunkRecord& chunk : view.chunks)
        for (uint32_t i = 0; i < chunk.anchor_count; ++i) {
            GridPosition position;
            std::memcpy(&position, storedValue(view, chunk, ChunkArray::Position, i), sizeof(position));
            uint32_t source;
            std::memcpy(&source, storedValue(view, chunk, ChunkArray::SourceIndex, i), sizeof(source));
            REQUIRE(view.index[source] == chunk.anchor_first + i);
            int32_t cell[3], leaf[3];
            for (int axis = 0; axis < 3; ++axis) {
                cell[axis] = (chunk.origin[axis] + position.local[axis]) >> view.levels[chunk.level_index].cell_log2;
                leaf[axis] = cell[axis] >> 3;
            }
            keys.emplace_back(chunk.level_index, bitsFromTheTop(leaf), bitsFromTheTop(cell), source);
        }
    CHECK(keys.size() == 6000);
    CHECK(std::is_sorted(keys.begin(), keys.end()));
}

TEST_CASE("trap 12, trap 28: anchors that share a cell are all kept, in source order")
{
    for (const uint32_t levels : {0, 2}) {
        ModelShape shape;
        shape.anchors = 2000;
        shape.levels = levels;
        shape.spread = 1; // 27 cells
        const MemoryModel model = makeModel(shape);
        const Written written = writeModel(model);
        checkEqual(model, written);
        CHECK(written.report.anchors == 2000);
    }
    ModelShape shape;
    shape.anchors = 1000;
    shape.spread = 0; // one cell, one leaf, one chunk
    const MemoryModel model = makeModel(shape);
    const Written written = writeModel(model);
    REQUIRE(written.view.chunks.size() == 1);
    CHECK(written.view.leaves.size() == 1);
    CHECK(written.view.groups.size() == 8);
    for (uint32_t i = 0; i < 1000; ++i)
        REQUIRE(written.view.index[i] == i);
    checkEqual(model, written);
}

TEST_CASE("bounds contain every gaussian an anchor can emit, and are tight")
{
    ModelShape shape = octreeShape(4000);
    shape.spread = 2000;
    const MemoryModel model = makeModel(shape);
    WriteOptions options;
    options.chunk_anchors = 400;
    const Written written = writeModel(model, options);
    const GscView& view = written.view;
    for (const GroupRecord& group : view.groups) {
        const ChunkRecord& chunk = view.chunks[group.chunk];
        float low[3] = {1e30f, 1e30f, 1e30f}, high[3] = {-1e30f, -1e30f, -1e30f}, sigma = 0;
        for (uint32_t a = group.anchor_first; a < group.anchor_first + group.anchor_count; ++a) {
            const uint32_t i = a - chunk.anchor_first;
            float position[3], scale[6];
            storedPosition(view, chunk, i, position);
            std::memcpy(scale, storedValue(view, chunk, ChunkArray::Scale, i), sizeof(scale));
            for (int s = 3; s < 6; ++s)
                sigma = std::max(sigma, std::exp(scale[s]));
            for (uint32_t k = 0; k < view.params->n_offsets; ++k)
                for (int axis = 0; axis < 3; ++axis) {
                    float offset;
                    std::memcpy(&offset, storedValue(view, chunk, ChunkArray::Offset, i) + 4 * (3 * k + uint32_t(axis)),
                                sizeof(offset));
                    // an exp that is off by 4 ulps either way must not escape
                    for (const float factor : {1.0f, 1.0f + 0x1p-21f, 1.0f - 0x1p-21f}) {
                        const float center = position[axis] + offset * (std::exp(scale[axis]) * factor);
                        REQUIRE(center >= group.gaussian_min[axis]);
                        REQUIRE(center <= group.gaussian_max[axis]);
                        REQUIRE(center >= chunk.gaussian_min[axis]);
                        REQUIRE(center <= chunk.gaussian_max[axis]);
                    }
                    const float center = position[axis] + offset * std::exp(scale[axis]);
                    low[axis] = std::min(low[axis], center);
                    high[axis] = std::max(high[axis], center);
                }
        }
        REQUIRE(sigma <= group.gaussian_sigma_max);
        REQUIRE(sigma >= group.gaussian_sigma_max * 0.99999f);
        for (int axis = 0; axis < 3; ++axis) {
            REQUIRE(low[axis] - group.gaussian_min[axis] < 1e-4f);
            REQUIRE(group.gaussian_max[axis] - high[axis] < 1e-4f);
        }
    }
}

TEST_CASE("trap 15: scales of -inf and anchors at zeros of both signs are stored as they are")
{
    ModelShape shape;
    shape.anchors = 400;
    MemoryModel model = makeModel(shape);
    for (size_t i = 0; i < 50; ++i) {
        for (int axis = 0; axis < 3; ++axis)
            model.anchors.position[3 * i + size_t(axis)] = (i >> axis & 1) ? -0.0f : 0.0f;
        for (size_t s = 0; s < 6; ++s)
            if (i & (1u << (s % 3)))
                model.anchors.scale[6 * i + s] = -INFINITY;
    }
    const Written written = writeModel(model);
    CHECK(written.report.exact_grid);
    checkEqual(model, written);
}

TEST_CASE("trap 29: level biases keep their bits")
{
    MemoryModel model = makeModel(octreeShape(500));
    for (size_t i = 0; i < 500; ++i) {
        float sum = 0; // the trainer's running sum of 0.01, which is not a multiple of 0.01
        for (size_t k = 0; k < i; ++k)
            sum += 0.01f;
        model.anchors.extra_level[i] = sum;
    }
    checkEqual(model, writeModel(model));
}

TEST_CASE("rotation, opacity and normal are constants where they are constant, else arrays")
{
    ModelShape shape;
    shape.anchors = 300;
    const Written constant = writeModel(makeModel(shape));
    CHECK((constant.view.params->flags & (kModelHasRotation | kModelHasOpacity | kModelHasNormal)) == 0);
    CHECK(constant.view.params->constant_rotation[0] == 1);
    CHECK(constant.view.params->constant_opacity == -2.1972246f);

    MemoryModel model = makeModel(shape);
    model.anchors.rotation[4 * 299 + 2] = -0.0f; // bits, not values
    CHECK((writeModel(model).view.params->flags & kModelHasRotation) != 0);
    model.anchors.opacity[0] = 0.5f;
    model.anchors.normal[7] = 1;
    const Written varying = writeModel(model);
    const uint32_t all = kModelHasRotation | kModelHasOpacity | kModelHasNormal;
    CHECK((varying.view.params->flags & all) == all);
    const float identity[4] = {1, 0, 0, 0}; // without an array no anchor has a value of its own
    model.anchors.rotation.assign(model.anchors.rotation.size(), 0.5f);
    CHECK(writeModel(model).view.params->constant_rotation[3] == 0.5f);
    model.anchors.rotation[0] = 0.25f;
    const Written turned = writeModel(model);
    for (const Written* written : {&varying, &turned}) {
        CHECK(std::equal(identity, identity + 4, written->view.params->constant_rotation));
        CHECK(written->view.params->constant_opacity == 0);
    }
    checkEqual(model, turned);
}

TEST_CASE("positions off the grid are stored as floats, with a warning that counts them")
{
    for (const uint32_t levels : {0, 2}) {
        ModelShape shape;
        shape.anchors = 3000;
        shape.levels = levels;
        shape.origin = levels ? -3.213f : 0.0f; // zero is not on the grid of the second
        MemoryModel model = makeModel(shape);
        model.anchors.position[3 * 1234] += 0.004f;
        model.anchors.position[3 * 77 + 2] = -0.0f;
        const Written written = writeModel(model);
        CHECK_FALSE(written.report.exact_grid);
        REQUIRE(written.report.warnings.size() == 1);
        INFO(written.report.warnings[0]);
        const std::string count = levels ? "2" : "1";
        CHECK(written.report.warnings[0].find(count + " of 3000 anchors do not lie on the grid of the others") == 0);
        CHECK(written.view.params->position_encoding == uint32_t(PositionEncoding::Float));
        checkEqual(model, written);
    }
    ModelShape shape;
    shape.anchors = 2000;
    MemoryModel model = makeModel(shape);
    std::mt19937 random(4);
    for (float& p : model.anchors.position)
        p = std::ldexp(float(int32_t(random())), int(random() % 60) - 60);
    const Written written = writeModel(model);
    REQUIRE(written.report.warnings.size() == 1);
    CHECK(written.report.warnings[0].find("the 2000 anchors do not lie on one voxel grid") == 0);
    checkEqual(model, written);
}

TEST_CASE("trap 11: the LOD rule keeps the trainer's voxel size where positions are stored as floats")
{
    const MemoryModel model = makeModel(octreeShape(3000));
    const Written grid = writeModel(model);
    REQUIRE(grid.report.exact_grid);
    MemoryModel off_grid = model;
    off_grid.anchors.position[3 * 1234] += 0.004f;
    MemoryModel other_grid = model; // `info` says something else than the positions
    other_grid.checkpoint.voxel_size *= 1.5f;
    for (const MemoryModel& changed : {off_grid, other_grid}) {
        const Written floats = writeModel(changed);
        CHECK_FALSE(floats.report.exact_grid);
        CHECK(floats.report.warnings.size() == 1);
        CHECK(floats.view.params->voxel_size == changed.checkpoint.voxel_size);
        checkEqual(changed, floats);
    }

    const ModelParams &a = *grid.view.params, b = *writeModel(off_grid).view.params;
    CHECK(a.flags == b.flags);
    CHECK(a.lod_scale == b.lod_scale);
    CHECK(a.standard_dist == b.standard_dist);
    CHECK(a.fork == b.fork);
    CHECK(a.level_clamp == b.level_clamp);
    CHECK(a.level_rule == b.level_rule);
    const float center[3] = {3.0f, -4.0f, 5.0f};
    size_t shown = 0, differ = 0;
    for (size_t i = 0; i < model.anchors.count; ++i) {
        const float* p = &model.anchors.position[3 * i];
        const int32_t level = model.anchors.level[i];
        const auto predict = [&](const ModelParams& params) {
            return predictedLevel<float>(params, {p[0], p[1], p[2]}, lodShift<float>(params, level), center,
                                         model.anchors.extra_level[i], 0.0f);
        };
        shown += level <= chooseLevel(LevelRule(a.level_rule), predict(a), a.level_clamp).level ? 1 : 0;
        differ += predict(a) != predict(b) ? 1 : 0;
    }
    CHECK(shown > 0);
    CHECK(shown < model.anchors.count);
    CHECK(differ == 0);
}

TEST_CASE("positions far out and grids finer than chunks can span are stored exactly")
{
    ModelShape shape;
    shape.anchors = 500;
    MemoryModel model = makeModel(shape);
    for (const float far : {1e6f, 1e20f, -1e29f}) {
        model.anchors.position[0] = far;
        checkEqual(model, writeModel(model));
    }
    shape.spread = 100'000'000; // near the largest quanta: a chunk per anchor, were they stored as quanta
    shape.voxel_size = 0.5f;
    const MemoryModel wide = makeModel(shape);
    const Written written = writeModel(wide);
    CHECK_FALSE(written.report.exact_grid);
    REQUIRE(written.report.warnings.size() == 1);
    CHECK(written.report.warnings[0].find("too fine for the extent of the model") != std::string::npos);
    CHECK(written.view.chunks.size() <= 64);
    checkEqual(wide, written);
    WriteOptions options;
    options.chunk_anchors = 1; // asked for, so given
    const Written fine = writeModel(wide, options);
    CHECK(fine.report.exact_grid);
    checkEqual(wide, fine);
}

TEST_CASE("trap 24: one row of the embedding can be kept, under its number")
{
    ModelShape shape;
    shape.appearance_dim = 5;
    shape.appearance_rows = 7;
    shape.anchors = 50;
    const MemoryModel model = makeModel(shape);
    WriteOptions options;
    options.appearance = 4;
    const Written written = writeModel(model, options);
    REQUIRE(written.view.embedding_rows.size() == 1);
    CHECK(written.view.embedding_rows[0] == 4);
    CHECK(std::memcmp(written.view.embedding.data(), &model.checkpoint.embedding[20], 20) == 0);
    checkEqual(model, written);
    for (const int row : {7, 1000}) {
        options.appearance = row;
        options.output = "never-written.gsc";
        MemorySource source(model);
        CHECK_THROWS_AS(writeGscFrom(model.checkpoint, source, options, {}), Error);
    }
}

TEST_CASE("chunks hold what was asked for, on average")
{
    ModelShape shape;
    shape.anchors = 20000;
    shape.spread = 3000;
    const MemoryModel model = makeModel(shape);
    uint64_t last = UINT64_MAX;
    for (const uint64_t wanted : {50, 500, 5000}) {
        WriteOptions options;
        options.chunk_anchors = wanted;
        const Written written = writeModel(model, options);
        const uint64_t chunks = written.view.chunks.size();
        CAPTURE(chunks);
        const bool enough = 20000 / chunks >= wanted || chunks == 8; // the middle is a corner of eight nodes
        CHECK(enough);
        CHECK(chunks <= last);
        last = chunks;
    }
}

TEST_CASE("the manifest says what the file is and nothing of where or when")
{
    MemoryModel model = makeModel(octreeShape(100));
    model.checkpoint.ply_path = "";
    model.checkpoint.model_path = "/secret/place/model";
    const Written written = writeModel(model);
    const std::string manifest(written.view.manifest);
    CHECK(manifest.find("\"family\": \"octree-gs\"") != std::string::npos);
    CHECK(manifest.find("\"position\": \"grid16\"") != std::string::npos);
    CHECK(manifest.find("/secret") == std::string::npos);
    for (const auto& [iteration, text] : {std::pair<int, const char*>{0, "0"}, {30000, "30000"}, {-1, "null"}}) {
        model.checkpoint.iteration = iteration;
        CHECK(std::string(writeModel(model).view.manifest).find("\"iteration\": " + std::string(text)) !=
              std::string::npos);
    }
    CHECK(written.view.header->config_hash != 0);
    WriteOptions options;
    options.chunk_anchors = 5;
    CHECK(writeModel(model, options).view.header->config_hash != written.view.header->config_hash);
}
