// SPDX-License-Identifier: Apache-2.0
#include "tests/write/memory_model.h"

#include "convert/grids/nanovdb_check.h"
#include "convert/survey/grid_fit.h"
#include <gsc/error.h>

#include <doctest/doctest.h>

#include <algorithm>
#include <csignal>
#include <cstring>
#include <filesystem>
#include <random>

#include <unistd.h>

namespace gsc::test {

namespace {

float uniform(std::mt19937& random, float low, float high)
{
    return low + (high - low) * (float(random() >> 8) / float(1 << 24));
}

LinearLayer makeLayer(std::mt19937& random, uint32_t in, uint32_t out)
{
    LinearLayer layer{in, out, std::vector<float>(size_t(in) * out), std::vector<float>(out)};
    for (float& w : layer.weight)
        w = uniform(random, -1, 1);
    for (float& b : layer.bias)
        b = uniform(random, -1, 1);
    return layer;
}

std::vector<Mlp> makeMlps(const ModelShape& shape, std::mt19937& random)
{
    const uint32_t view =
        (shape.distance ? kMlpTakesDistance : 0u) | (shape.level_input && shape.levels ? kMlpTakesLevel : 0u);
    const uint32_t extra = (view & kMlpTakesDistance ? 1 : 0) + (view & kMlpTakesLevel ? 1 : 0);
    const uint32_t f = shape.feat_dim, a = shape.appearance_dim;
    std::vector<Mlp> mlps(3);
    const uint32_t out[3] = {shape.n_offsets, 7 * shape.n_offsets, 3 * shape.n_offsets};
    const Activation activation[3] = {Activation::Tanh, Activation::None, Activation::Sigmoid};
    for (uint32_t i = 0; i < 3; ++i) {
        const bool appearance = i == 2 && a > 0;
        mlps[i].kind = MlpKind(i);
        mlps[i].activation = activation[i];
        mlps[i].inputs = kMlpTakesFeature | view | (appearance ? kMlpTakesAppearance : 0u);
        mlps[i].layers[0] = makeLayer(random, f + 3 + extra + (appearance ? a : 0), f);
        mlps[i].layers[1] = makeLayer(random, f, out[i]);
    }
    if (shape.feature_bank) {
        Mlp bank;
        bank.kind = MlpKind::FeatureBank;
        bank.activation = Activation::Softmax;
        bank.inputs = shape.levels ? (shape.level_input ? kMlpTakesLevel : 0u) : uint32_t(kMlpTakesDistance);
        bank.layers[0] = makeLayer(random, 3 + (bank.inputs ? 1 : 0), f);
        bank.layers[1] = makeLayer(random, f, 3);
        mlps.push_back(bank);
    }
    return mlps;
}

template <typename T>
void copyRows(std::vector<T>& out, const std::vector<T>& all, size_t stride, size_t first, size_t count, bool wanted)
{
    out.clear();
    if (wanted)
        out.assign(all.begin() + ptrdiff_t(first * stride), all.begin() + ptrdiff_t((first + count) * stride));
}

template <typename T>
void eraseRow(std::vector<T>& values, size_t stride, size_t row)
{
    values.erase(values.begin() + ptrdiff_t(row * stride), values.begin() + ptrdiff_t((row + 1) * stride));
}

} // namespace

MemoryModel makeModel(const ModelShape& shape)
{
    std::mt19937 random(shape.seed);
    MemoryModel model;
    Checkpoint& c = model.checkpoint;
    c.model_path = "memory";
    c.container = "split";
    c.family = shape.levels ? ModelFamily::OctreeGs : ModelFamily::ScaffoldGs;
    c.anchor_count = shape.anchors;
    c.feat_dim = shape.feat_dim;
    c.n_offsets = shape.n_offsets;
    c.appearance_dim = shape.appearance_dim;
    c.flags = shape.levels ? kModelHasLevels | kModelLodHalfCell : 0;
    if (shape.feature_bank)
        c.flags |= kModelFeatureBank |
                   (shape.levels ? (shape.level_input ? kModelBankLevel : 0u) : uint32_t(kModelBankDistance));
    c.level_rule = shape.levels ? LevelRule::Round : LevelRule::None;
    c.level_clamp = shape.levels ? int32_t(shape.levels) - 1 : 0;
    c.standard_dist = shape.levels ? 10.0f : 0.0f;
    c.voxel_size = shape.voxel_size;
    c.mlps = makeMlps(shape, random);
    for (uint32_t i = 0; i < shape.appearance_rows * shape.appearance_dim; ++i)
        c.embedding.push_back(uniform(random, -1, 1));

    AnchorBatch& b = model.anchors;
    b.count = shape.anchors;
    for (uint64_t i = 0; i < shape.anchors; ++i) {
        const int32_t level = shape.levels ? int32_t(random() % shape.levels) : 0;
        const float quantum = levelQuantum(shape.voxel_size, 2, level);
        for (int axis = 0; axis < 3; ++axis) {
            const int32_t k = int32_t(random() % uint32_t(2 * shape.spread + 1)) - shape.spread;
            b.position.push_back(gridCoordinate(k, quantum, shape.origin, false));
        }
        b.level.push_back(level);
        b.extra_level.push_back(shape.levels ? uniform(random, 0, 2) : 0.0f);
        for (uint32_t j = 0; j < 3 * shape.n_offsets; ++j)
            b.offset.push_back(uniform(random, -3, 3));
        for (uint32_t j = 0; j < shape.feat_dim; ++j)
            b.feature.push_back(uniform(random, -2, 2));
        for (int j = 0; j < 6; ++j)
            b.scale.push_back(uniform(random, -6, 0));
        b.rotation.insert(b.rotation.end(), {1, 0, 0, 0});
        b.opacity.push_back(-2.1972246f);
        b.normal.insert(b.normal.end(), {0, 0, 0});
    }
    return model;
}

void MemoryModel::removeAnchor(size_t i)
{
    eraseRow(anchors.position, 3, i);
    eraseRow(anchors.level, 1, i);
    eraseRow(anchors.extra_level, 1, i);
    eraseRow(anchors.offset, 3 * checkpoint.n_offsets, i);
    eraseRow(anchors.feature, checkpoint.feat_dim, i);
    eraseRow(anchors.scale, 6, i);
    eraseRow(anchors.rotation, 4, i);
    eraseRow(anchors.opacity, 1, i);
    eraseRow(anchors.normal, 3, i);
    --anchors.count;
    --checkpoint.anchor_count;
}

bool MemorySource::next(AnchorBatch& batch, uint32_t fields, size_t max_rows)
{
    const AnchorBatch& all = m_model.anchors;
    const uint64_t total = std::min<uint64_t>(all.count, rows);
    // odd sizes, so that batches never coincide with chunks or groups
    const size_t count = size_t(std::min<uint64_t>({total - m_next, max_rows, 37}));
    if (passes_before_failure == 0 && m_next + count > fail_at)
        throw Error(ErrorCode::Io, "memory", "the source broke", "more rows", "mend it");
    if (passes_before_failure == 0 && m_next + count > interrupt_at)
        std::raise(SIGINT);
    if (count == 0 && passes_before_failure > 0)
        --passes_before_failure;
    batch.first = m_next;
    batch.count = count;
    const bool placement = fields & kAnchorPlacement, rest = fields == kAnchorAll;
    const Checkpoint& c = m_model.checkpoint;
    copyRows(batch.position, all.position, 3, m_next, count, placement);
    copyRows(batch.level, all.level, 1, m_next, count, placement);
    copyRows(batch.extra_level, all.extra_level, 1, m_next, count, placement);
    copyRows(batch.offset, all.offset, 3 * c.n_offsets, m_next, count, rest);
    copyRows(batch.feature, all.feature, c.feat_dim, m_next, count, rest);
    copyRows(batch.scale, all.scale, 6, m_next, count, rest);
    copyRows(batch.rotation, all.rotation, 4, m_next, count, rest);
    copyRows(batch.opacity, all.opacity, 1, m_next, count, rest);
    copyRows(batch.normal, all.normal, 3, m_next, count, rest);
    m_next += count;
    return count != 0;
}

std::string Written::bytes() const
{
    return {reinterpret_cast<const char*>(file->bytes().data()), file->bytes().size()};
}

Written openWritten(const std::string& path)
{
    Written written;
    written.file = std::make_unique<MappedFile>(path);
    std::string issues;
    const IssueSink sink = [&](const Issue& issue) {
        issues += formatString("%u %s %s: %s\n", unsigned(issue.info->id), issue.info->name, issue.pointer.c_str(),
                               issue.detail.c_str());
    };
    const bool valid = openGsc(written.file->bytes(), written.view, GscCheck::Full, sink);
    if (valid)
        checkNanoVdb(written.view, sink);
    INFO(issues);
    REQUIRE(valid);
    REQUIRE(issues.empty());
    return written;
}

Written writeModel(const MemoryModel& model, WriteOptions options)
{
    const TemporaryFolder folder; // the mapping outlives the name
    options.output = folder / "model.gsc";
    MemorySource source(model);
    const WriteReport report = writeGscFrom(model.checkpoint, source, options, {});
    CHECK(folder.names() == std::vector<std::string>{"model.gsc"});
    Written written = openWritten(options.output);
    written.report = report;
    return written;
}

const std::byte* storedValue(const GscView& view, const ChunkRecord& chunk, ChunkArray array, uint32_t local)
{
    const ChunkArrayLayout layout = chunkArrayLayout(*view.params, chunk.anchor_count);
    const uint32_t a = uint32_t(array);
    return chunkPayload(view, chunk).data() + layout.offset[a] + layout.stride[a] * local;
}

void storedPosition(const GscView& view, const ChunkRecord& chunk, uint32_t local, float out[3])
{
    const std::byte* bytes = storedValue(view, chunk, ChunkArray::Position, local);
    if (view.params->position_encoding == uint32_t(PositionEncoding::Float)) {
        std::memcpy(out, bytes, 3 * sizeof(float));
        return;
    }
    GridPosition position;
    std::memcpy(&position, bytes, sizeof(position));
    const LevelRecord& level = view.levels[chunk.level_index];
    for (int axis = 0; axis < 3; ++axis)
        out[axis] = gridCoordinate(chunk.origin[axis] + position.local[axis], level.quantum, level.origin,
                                   position.flags & (kNegativeZeroX << axis));
}

} // namespace gsc::test
