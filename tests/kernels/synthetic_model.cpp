// SPDX-License-Identifier: Apache-2.0
#include "tests/kernels/synthetic_model.h"

#include "convert/write/mlp_pack.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <tuple>

namespace gsc::test {

namespace {

uint64_t spread(uint32_t v) // 21 bits to every third bit
{
    uint64_t x = v & 0x1fffff;
    x = (x | x << 32) & 0x1f00000000ffffull;
    x = (x | x << 16) & 0x1f0000ff0000ffull;
    x = (x | x << 8) & 0x100f00f00f00f00full;
    x = (x | x << 4) & 0x10c30c30c30c30c3ull;
    return (x | x << 2) & 0x1249249249249249ull;
}

float largest(const float* v, int n)
{
    float m = -INFINITY;
    for (int i = 0; i < n; ++i)
        m = std::max(m, v[i]);
    return std::exp(m);
}

// Bounds of a run of anchors, as GroupRecord and ChunkRecord hold them.
struct Bounds {
    float anchor_min[3], anchor_max[3], gaussian_min[3], gaussian_max[3];
    float anchor_sigma = 0, gaussian_sigma = 0, extra_min = INFINITY, extra_max = -INFINITY;

    Bounds()
    {
        for (int c = 0; c < 3; ++c) {
            anchor_min[c] = gaussian_min[c] = INFINITY;
            anchor_max[c] = gaussian_max[c] = -INFINITY;
        }
    }

    void add(const float* position, const float* scale, const float* offset, uint32_t offsets, float extra)
    {
        for (int c = 0; c < 3; ++c) {
            anchor_min[c] = std::min(anchor_min[c], position[c]);
            anchor_max[c] = std::max(anchor_max[c], position[c]);
            for (uint32_t k = 0; k < offsets; ++k) {
                const float center = position[c] + offset[3 * k + c] * std::exp(scale[c]);
                gaussian_min[c] = std::min(gaussian_min[c], center);
                gaussian_max[c] = std::max(gaussian_max[c], center);
            }
        }
        anchor_sigma = std::max(anchor_sigma, largest(scale, 3));
        gaussian_sigma = std::max(gaussian_sigma, largest(scale + 3, 3));
        extra_min = std::min(extra_min, extra);
        extra_max = std::max(extra_max, extra);
    }

    template <typename Record>
    void store(Record& record) const
    {
        for (int c = 0; c < 3; ++c) {
            record.anchor_min[c] = anchor_min[c];
            record.anchor_max[c] = anchor_max[c];
            record.gaussian_min[c] = gaussian_min[c];
            record.gaussian_max[c] = gaussian_max[c];
        }
        record.anchor_sigma_max = anchor_sigma;
        record.gaussian_sigma_max = gaussian_sigma;
        record.extra_level_min = extra_min;
        record.extra_level_max = extra_max;
    }
};

} // namespace

// Where an anchor goes.
struct Placement {
    int32_t level;
    std::array<int32_t, 3> node; // chunk, in nodes
    std::array<int32_t, 3> quanta;
    uint64_t morton;
    uint32_t source;
};

struct SyntheticModel::Storage {
    ModelParams params{};
    std::vector<LevelRecord> levels;
    std::vector<ChunkRecord> chunks;
    std::vector<GroupRecord> groups;
    std::vector<ChunkArrays> arrays;
    std::vector<std::byte> weights, packed;
    std::vector<float> embedding;
    ModelView view{};

    // arrays of all anchors in file order; a chunk points into them
    std::vector<GridPosition> grid_position;
    std::vector<float> float_position, extra_level, scale, offset, feature, rotation;
    std::vector<uint32_t> source_index;
    std::vector<Bounds> chunk_bounds, group_bounds;

    [[nodiscard]] bool usesGrid() const { return params.position_encoding == uint32_t(PositionEncoding::Grid); }
    void openRecords(const Placement& p, const Placement* before, uint32_t anchor, uint32_t cell_log2);
    void putAnchor(const SyntheticAnchors& anchors, const Placement& p);
    void pointChunks();
};

namespace {

// Level, chunk, place in the chunk and source index: the order of a file.
std::vector<Placement> place(const ModelParams& params, const SyntheticAnchors& anchors, uint32_t cell_log2)
{
    std::vector<Placement> placements;
    for (uint32_t i = 0; i < anchors.count(); ++i) {
        Placement p{};
        p.level = anchors.level[i];
        p.source = i;
        const float quantum = params.voxel_size / std::pow(float(params.fork), float(p.level));
        uint32_t local[3];
        for (int c = 0; c < 3; ++c) {
            const float steps = std::round((anchors.position[3 * i + c] - params.grid_origin) / quantum);
            p.quanta[c] = std::isfinite(steps) ? int32_t(steps) : 0;
            p.node[c] = p.quanta[c] >> (kChunkLog2 + cell_log2);
            local[c] = uint32_t(p.quanta[c] - p.node[c] * (1 << (kChunkLog2 + cell_log2)));
        }
        p.morton = spread(local[0]) | spread(local[1]) << 1 | spread(local[2]) << 2;
        placements.push_back(p);
    }
    std::sort(placements.begin(), placements.end(), [](const Placement& a, const Placement& b) {
        return std::tie(a.level, a.node, a.morton, a.source) < std::tie(b.level, b.node, b.morton, b.source);
    });
    return placements;
}

} // namespace

// Starts the level, chunk and group that anchor number `anchor` needs, and counts it.
void SyntheticModel::Storage::openRecords(const Placement& p, const Placement* before, uint32_t anchor,
                                          uint32_t cell_log2)
{
    const bool new_level = before == nullptr || p.level != before->level;
    if (new_level) {
        LevelRecord level{};
        level.level = p.level;
        level.cell_log2 = cell_log2;
        level.quantum = params.voxel_size / std::pow(float(params.fork), float(p.level));
        level.origin = params.grid_origin;
        levels.push_back(level);
    }
    if (new_level || p.node != before->node) {
        ChunkRecord chunk{};
        chunk.level_index = uint32_t(levels.size() - 1);
        chunk.anchor_first = anchor;
        chunk.group_first = uint32_t(groups.size());
        for (int c = 0; c < 3; ++c)
            chunk.origin[c] = p.node[c] * (1 << (kChunkLog2 + cell_log2));
        chunks.push_back(chunk);
        chunk_bounds.emplace_back();
    }
    ChunkRecord& chunk = chunks.back();
    if (chunk.anchor_count % kGroupSize == 0) {
        GroupRecord group{};
        group.anchor_first = anchor;
        group.chunk = uint32_t(chunks.size() - 1);
        group.level_index = uint16_t(chunk.level_index);
        groups.push_back(group);
        group_bounds.emplace_back();
        ++chunk.group_count;
    }
    ++chunk.anchor_count;
    ++groups.back().anchor_count;
}

void SyntheticModel::Storage::putAnchor(const SyntheticAnchors& anchors, const Placement& p)
{
    const uint32_t K = params.n_offsets, F = params.feat_dim;
    const ChunkRecord& chunk = chunks.back();
    const float* source = anchors.position.data() + 3 * size_t(p.source);
    float position[3] = {source[0], source[1], source[2]};
    GridPosition g{};
    for (int c = 0; c < 3 && usesGrid(); ++c) {
        g.local[c] = uint16_t(p.quanta[c] - chunk.origin[c]);
        position[c] = gridCoordinate(p.quanta[c], levels.back().quantum, params.grid_origin, false);
    }
    grid_position.push_back(g);
    float_position.insert(float_position.end(), position, position + 3);
    extra_level.push_back(anchors.extra_level[p.source]);
    source_index.push_back(p.source);
    const auto append = [&p](std::vector<float>& to, const std::vector<float>& from, size_t width) {
        to.insert(to.end(), from.begin() + ptrdiff_t(width * p.source),
                  from.begin() + ptrdiff_t(width * (p.source + 1)));
    };
    append(scale, anchors.scale, 6);
    append(offset, anchors.offset, size_t(3) * K);
    append(feature, anchors.feature, F);
    if (!anchors.rotation.empty())
        append(rotation, anchors.rotation, 4);
    for (Bounds* bounds : {&chunk_bounds.back(), &group_bounds.back()})
        bounds->add(position, scale.data() + scale.size() - 6, offset.data() + offset.size() - size_t(3) * K, K,
                    extra_level.back());
}

// Once no array grows any more.
void SyntheticModel::Storage::pointChunks()
{
    const uint32_t K = params.n_offsets, F = params.feat_dim;
    for (size_t c = 0; c < chunks.size(); ++c) {
        ChunkRecord& chunk = chunks[c];
        chunk_bounds[c].store(chunk);
        const size_t first = chunk.anchor_first;
        ChunkArrays to{};
        if (usesGrid())
            to.grid_position = grid_position.data() + first;
        else
            to.float_position = float_position.data() + 3 * first;
        to.source_index = source_index.data() + first;
        if (params.flags & kModelHasLevels)
            to.extra_level = extra_level.data() + first;
        to.scale = scale.data() + 6 * first;
        to.offset = offset.data() + size_t(3) * K * first;
        to.feature = feature.data() + size_t(F) * first;
        if (!rotation.empty())
            to.rotation = rotation.data() + 4 * first;
        arrays.push_back(to);
        params.max_chunk_anchors = std::max(params.max_chunk_anchors, chunk.anchor_count);
    }
    for (size_t g = 0; g < groups.size(); ++g)
        group_bounds[g].store(groups[g]);
}

SyntheticModel::SyntheticModel(const ModelParams& params, const SyntheticAnchors& anchors, const std::vector<Mlp>& mlps,
                               std::vector<float> embedding, uint32_t cell_log2)
    : m_storage(std::make_unique<Storage>())
{
    Storage& s = *m_storage;
    s.params = params;
    s.embedding = std::move(embedding);
    s.weights = canonicalMlps(mlps);
    s.packed = packMlps(mlps, params.feat_dim, params.appearance_dim);
    const std::vector<Placement> order = place(params, anchors, cell_log2);
    for (size_t i = 0; i < order.size(); ++i) {
        s.openRecords(order[i], i > 0 ? &order[i - 1] : nullptr, uint32_t(i), cell_log2);
        s.putAnchor(anchors, order[i]);
    }
    s.pointChunks();
    if (!s.rotation.empty())
        s.params.flags |= kModelHasRotation;
    s.params.level_count = uint32_t(s.levels.size());
    s.params.chunk_count = s.chunks.size();
    s.params.group_count = s.groups.size();
    s.params.mlp_count = uint32_t(mlps.size());
    s.view = {&s.params,       s.levels.data(),  s.chunks.data(), s.groups.data(),
              s.arrays.data(), s.weights.data(), s.packed.data(), s.embedding.empty() ? nullptr : s.embedding.data(),
              nullptr};
}

bool isSlotMasked(uint32_t anchor, uint32_t k)
{
    return anchor % 11 == 0 || (anchor * 7 + k * 5) % 4 == 0;
}

void maskSlots(SyntheticAnchors& anchors, uint32_t n_offsets)
{
    for (uint32_t i = 0; i < anchors.count(); ++i)
        for (uint32_t k = 0; k < n_offsets; ++k)
            if (isSlotMasked(i, k))
                std::fill_n(anchors.offset.begin() + ptrdiff_t(3 * (size_t(i) * n_offsets + k)), 3,
                            std::bit_cast<float>(kMaskedOffset));
}

SyntheticModel::~SyntheticModel() = default;

const ModelView& SyntheticModel::view() const
{
    return m_storage->view;
}
ModelParams& SyntheticModel::params()
{
    return m_storage->params;
}

} // namespace gsc::test
