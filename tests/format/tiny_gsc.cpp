// SPDX-License-Identifier: Apache-2.0
#include "tests/format/tiny_gsc.h"

#include "tests/format/tiny_mlps.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <random>

namespace gsc::test {

namespace {

constexpr float kVoxelSize = 0.03125f;

struct Anchor {
    uint32_t level;
    std::array<int32_t, 3> quanta;
    uint32_t source;
    float extra_level;
    std::vector<float> scale, offset, feature, rotation, normal;
    float opacity;
};

struct Box {
    float low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY};

    void add(uint32_t axis, float a, float b)
    {
        low[axis] = std::min(low[axis], a);
        high[axis] = std::max(high[axis], b);
    }
    void add(const float (&a)[3], const float (&b)[3])
    {
        for (uint32_t axis = 0; axis < 3; ++axis)
            add(axis, a[axis], b[axis]);
    }
    void store(float (&a)[3], float (&b)[3]) const
    {
        std::copy(low, low + 3, a);
        std::copy(high, high + 3, b);
    }
};

// Bits of the biased cell coordinates interleaved, x lowest.
std::array<uint64_t, 2> mortonOf(const std::array<int32_t, 3>& cell)
{
    std::array<uint64_t, 2> key{};
    for (uint32_t bit = 0; bit < 32; ++bit)
        for (uint32_t axis = 0; axis < 3; ++axis) {
            const uint32_t place = 3 * bit + axis;
            const uint64_t value = (uint32_t(cell[axis]) ^ 0x80000000u) >> bit & 1u;
            key[1 - place / 64] |= value << place % 64;
        }
    return key;
}

template <typename T>
std::vector<std::byte> bytesOf(const std::vector<T>& values)
{
    const auto bytes = std::as_bytes(std::span(values));
    return {bytes.begin(), bytes.end()};
}

class Builder {
public:
    explicit Builder(const TinyGscOptions& options) : m_options(options), m_random(options.seed) {}

    std::vector<std::byte> build()
    {
        makeParams();
        makeAnchors();
        for (uint32_t level = 0; level < m_options.levels; ++level)
            makeLevel(level);
        finishParams();
        const TinyMlps mlps = tinyMlps(m_options, m_random);

        const std::vector<AnchorSensitivity> sensitivity =
            m_options.sensitivity ? sensitivities() : std::vector<AnchorSensitivity>{};

        std::vector<TinySection> sections;
        const auto add = [&](uint32_t type, uint64_t count, std::vector<std::byte> content) {
            SectionEntry entry{};
            entry.type = type;
            entry.version = 1;
            entry.count = count;
            entry.flags = type == kSectionSensitivity || type == kSectionTile ? uint32_t(kSectionOptional) : 0;
            sections.push_back({entry, std::move(content)});
        };
        const auto text = std::as_bytes(std::span(m_options.manifest));
        add(kSectionAnchors, m_options.anchors, std::move(m_payloads));
        add(kSectionMeta, 0, {text.begin(), text.end()});
        add(kSectionParams, 1, bytesOf(std::vector<ModelParams>{m_params}));
        add(kSectionLevels, m_levels.size(), bytesOf(m_levels));
        add(kSectionChunks, m_chunks.size(), bytesOf(m_chunks));
        add(kSectionGroups, m_groups.size(), bytesOf(m_groups));
        add(kSectionLeaves, m_leaves.size(), bytesOf(m_leaves));
        add(kSectionNanoVdb, m_levels.size(), std::move(m_grids));
        add(kSectionIndex, m_index.size(), bytesOf(m_index));
        if (m_options.sensitivity)
            add(kSectionSensitivity, sensitivity.size(), bytesOf(sensitivity));
        if (m_options.tile)
            add(kSectionTile, m_index.size(), tile());
        add(kSectionWeights, m_params.mlp_count, mlps.canonical);
        add(kSectionPacked, 1, mlps.packed);
        if (m_options.appearance_dim > 0)
            add(kSectionEmbedding, m_options.appearance_rows, embedding());
        if (m_options.cameras > 0)
            add(kSectionCameras, m_options.cameras, cameras());
        FileHeader head{};
        head.anchor_count = m_options.anchors;
        head.source_hash = 0x0123456789abcdef;
        head.config_hash = 0xfedcba9876543210;
        return assembleGsc(head, std::move(sections));
    }

private:
    // Multiples of 2^-10 in [low, high): the same bits on every platform.
    float uniform(float low, float high) { return low + float(m_random() % 1024) / 1024.0f * (high - low); }

    std::vector<std::byte> tile() const
    {
        std::vector<uint32_t> rows(m_index.size());
        for (uint32_t i = 0; i < rows.size(); ++i)
            rows[i] = 2 * i + 1;
        std::vector<std::byte> bytes = bytesOf(std::vector<TileRecord>{{0x5555, 2 * rows.size()}});
        const std::vector<std::byte> more = bytesOf(rows);
        bytes.insert(bytes.end(), more.begin(), more.end());
        return bytes;
    }

    void makeParams()
    {
        const TinyGscOptions& o = m_options;
        const bool octree = o.levels > 1;
        ModelParams& p = m_params;
        p.family = uint32_t(octree ? ModelFamily::OctreeGs : ModelFamily::ScaffoldGs);
        p.flags = (octree ? kModelHasLevels | kModelLodHalfCell : 0u) |
                  (o.feature_bank ? kModelFeatureBank | (octree ? kModelBankLevel : kModelBankDistance) : 0u) |
                  (o.rotation ? kModelHasRotation : 0u) | (o.opacity ? kModelHasOpacity : 0u) |
                  (o.normal ? kModelHasNormal : 0u);
        p.feat_dim = o.feat_dim;
        p.n_offsets = o.n_offsets;
        p.appearance_dim = o.appearance_dim;
        p.appearance_rows = o.appearance_rows;
        p.level_rule = uint32_t(octree ? LevelRule::Round : LevelRule::None);
        p.fork = 2;
        p.level_clamp = int32_t(o.levels) - 1;
        p.standard_dist = octree ? 8.0f : 0.0f;
        p.voxel_size = kVoxelSize;
        p.grid_origin = octree ? o.grid_origin : 0.0f;
        p.position_encoding = uint32_t(o.float_positions ? PositionEncoding::Float : PositionEncoding::Grid);
        p.level_count = o.levels;
        p.constant_rotation[0] = 1;
        p.constant_opacity = -2.1972246f;
        p.near_z = 0.2f;
        p.mlp_count = o.feature_bank ? 4 : 3;
        p.chunk_payload_version = 1;
        p.lod_scale = 1;
    }

    void makeAnchors()
    {
        const TinyGscOptions& o = m_options;
        std::vector<uint32_t> sources(o.anchors);
        for (uint32_t i = 0; i < o.anchors; ++i)
            sources[i] = i;
        for (uint32_t i = o.anchors; i > 1; --i)
            std::swap(sources[i - 1], sources[m_random() % i]);
        const int32_t node = 1 << (kChunkLog2 + o.cell_log2);
        for (uint32_t i = 0; i < o.anchors; ++i) {
            Anchor a{};
            a.level = i % o.levels;
            // the first `nodes` anchors of a level open one node each; few leaves and cells, so that both are shared
            const uint32_t ordinal = i / o.levels;
            const uint32_t octant = ordinal < o.nodes ? ordinal : uint32_t(m_random() % o.nodes);
            for (uint32_t axis = 0; axis < 3; ++axis) {
                const int32_t corner = (octant >> axis & 1u) ? 0 : -node;
                a.quanta[axis] =
                    corner + int32_t(m_random() % 3) * node / 4 + int32_t(m_random() % uint32_t(node / 16));
            }
            a.source = sources[i];
            a.extra_level = o.levels > 1 ? uniform(0, 2) : 0;
            for (uint32_t c = 0; c < 6; ++c)
                a.scale.push_back(uniform(-6, -2));
            if (i == 0)
                a.scale[3] = -INFINITY; // legal: a Gaussian of size zero
            for (uint32_t c = 0; c < 3 * o.n_offsets; ++c)
                a.offset.push_back(uniform(-2, 2));
            for (uint32_t c = 0; c < o.feat_dim; ++c)
                a.feature.push_back(uniform(-1, 1));
            a.rotation = {1, uniform(-1, 1), 0, 0};
            a.opacity = uniform(-3, 3);
            a.normal = {0, uniform(-1, 1), 0};
            m_anchors.push_back(std::move(a));
        }
        const auto key = [&](const Anchor& a) {
            std::array<int32_t, 3> cell;
            for (uint32_t axis = 0; axis < 3; ++axis)
                cell[axis] = a.quanta[axis] >> m_options.cell_log2;
            return mortonOf(cell);
        };
        std::sort(m_anchors.begin(), m_anchors.end(), [&](const Anchor& a, const Anchor& b) {
            if (a.level != b.level)
                return a.level < b.level;
            const auto ka = key(a), kb = key(b);
            return ka != kb ? ka < kb : a.source < b.source;
        });
        m_index.resize(o.anchors);
        for (uint32_t i = 0; i < o.anchors; ++i)
            m_index[m_anchors[i].source] = i;
    }

    [[nodiscard]] std::array<int32_t, 3> corner(const Anchor& a, uint32_t log2) const
    {
        std::array<int32_t, 3> out;
        for (uint32_t axis = 0; axis < 3; ++axis)
            out[axis] = a.quanta[axis] >> log2 << log2;
        return out;
    }

    void makeLevel(uint32_t index)
    {
        LevelRecord level{};
        level.level = int32_t(index);
        level.cell_log2 = m_options.cell_log2;
        level.quantum = kVoxelSize / float(1u << index);
        level.origin = m_params.grid_origin;
        const auto first =
            std::find_if(m_anchors.begin(), m_anchors.end(), [&](const Anchor& a) { return a.level == index; });
        const auto last = std::find_if(first, m_anchors.end(), [&](const Anchor& a) { return a.level != index; });
        level.anchor_first = uint64_t(first - m_anchors.begin());
        level.anchor_count = uint64_t(last - first);
        level.chunk_first = m_chunks.size();
        level.group_first = m_groups.size();
        level.leaf_first = m_leaves.size();
        Box box;
        for (auto begin = first; begin != last;) {
            const uint32_t log2 = kChunkLog2 + m_options.cell_log2;
            const auto end =
                std::find_if(begin, last, [&](const Anchor& a) { return corner(a, log2) != corner(*begin, log2); });
            makeChunk(index, level, uint32_t(begin - m_anchors.begin()), uint32_t(end - begin));
            box.add(m_chunks.back().anchor_min, m_chunks.back().anchor_max);
            begin = end;
        }
        box.store(level.bounds_min, level.bounds_max);
        m_bounds.add(level.bounds_min, level.bounds_max);
        level.chunk_count = m_chunks.size() - level.chunk_first;
        level.group_count = m_groups.size() - level.group_first;
        level.leaf_count = m_leaves.size() - level.leaf_first;
        makeGrid(level);
        m_levels.push_back(level);
    }

    void makeChunk(uint32_t level_index, const LevelRecord& level, uint32_t first, uint32_t count)
    {
        ChunkRecord chunk{};
        const auto origin = corner(m_anchors[first], kChunkLog2 + m_options.cell_log2);
        std::copy(origin.begin(), origin.end(), chunk.origin);
        chunk.level_index = level_index;
        chunk.anchor_first = first;
        chunk.anchor_count = count;
        chunk.group_first = uint32_t(m_groups.size());
        chunk.leaf_first = uint32_t(m_leaves.size());
        chunk.payload_offset = alignUp(m_payloads.size(), kPayloadAlign);
        const ChunkArrayLayout layout = chunkArrayLayout(m_params, count);
        chunk.payload_bytes = layout.bytes;
        m_payloads.resize(chunk.payload_offset + layout.bytes);
        for (uint32_t i = 0; i < count; ++i)
            storeAnchor(m_anchors[first + i], level, origin, m_payloads.data() + chunk.payload_offset, layout, i);
        makeLeaves(first, count);
        chunk.leaf_count = uint32_t(m_leaves.size()) - chunk.leaf_first;
        makeGroups(chunk, level);
        m_chunks.push_back(chunk);
    }

    [[nodiscard]] static float coordinate(const Anchor& a, const LevelRecord& level, uint32_t axis)
    {
        return gridCoordinate(a.quanta[axis], level.quantum, level.origin, false);
    }

    void storeAnchor(const Anchor& a, const LevelRecord& level, const std::array<int32_t, 3>& origin,
                     std::byte* payload, const ChunkArrayLayout& layout, uint32_t i) const
    {
        const auto put = [&](ChunkArray array, const void* data) {
            const uint32_t k = uint32_t(array);
            if (layout.stride[k])
                std::memcpy(payload + layout.offset[k] + layout.stride[k] * i, data, layout.stride[k]);
        };
        GridPosition grid{};
        float position[3];
        for (uint32_t axis = 0; axis < 3; ++axis) {
            grid.local[axis] = uint16_t(a.quanta[axis] - origin[axis]);
            position[axis] = coordinate(a, level, axis);
        }
        put(ChunkArray::Position, m_options.float_positions ? static_cast<const void*>(position) : &grid);
        put(ChunkArray::SourceIndex, &a.source);
        put(ChunkArray::ExtraLevel, &a.extra_level);
        put(ChunkArray::Scale, a.scale.data());
        put(ChunkArray::Offset, a.offset.data());
        put(ChunkArray::Feature, a.feature.data());
        put(ChunkArray::Rotation, a.rotation.data());
        put(ChunkArray::Opacity, &a.opacity);
        put(ChunkArray::Normal, a.normal.data());
    }

    void makeLeaves(uint32_t first, uint32_t count)
    {
        const uint32_t log2 = kLeafLog2 + m_options.cell_log2;
        for (uint32_t i = first; i < first + count; ++i) {
            if (i == first || corner(m_anchors[i], log2) != corner(m_anchors[i - 1], log2)) {
                LeafRecord leaf{};
                leaf.anchor_first = i;
                const auto origin = corner(m_anchors[i], log2);
                for (uint32_t axis = 0; axis < 3; ++axis)
                    leaf.origin[axis] = origin[axis] >> m_options.cell_log2;
                m_leaves.push_back(leaf);
            }
            ++m_leaves.back().anchor_count;
        }
    }

    void makeGroups(ChunkRecord& chunk, const LevelRecord& level)
    {
        Box all_anchors, all_gaussians;
        chunk.extra_level_min = INFINITY;
        chunk.extra_level_max = -INFINITY;
        for (uint32_t begin = 0; begin < chunk.anchor_count; begin += kGroupSize) {
            GroupRecord group{};
            group.anchor_first = chunk.anchor_first + begin;
            group.anchor_count = uint16_t(std::min(kGroupSize, chunk.anchor_count - begin));
            group.chunk = uint32_t(m_chunks.size());
            group.level_index = uint16_t(chunk.level_index);
            group.extra_level_min = INFINITY;
            group.extra_level_max = -INFINITY;
            Box anchors, gaussians;
            for (uint32_t i = group.anchor_first; i < group.anchor_first + group.anchor_count; ++i)
                addBounds(m_anchors[i], level, group, anchors, gaussians);
            anchors.store(group.anchor_min, group.anchor_max);
            gaussians.store(group.gaussian_min, group.gaussian_max);
            all_anchors.add(group.anchor_min, group.anchor_max);
            all_gaussians.add(group.gaussian_min, group.gaussian_max);
            chunk.anchor_sigma_max = std::max(chunk.anchor_sigma_max, group.anchor_sigma_max);
            chunk.gaussian_sigma_max = std::max(chunk.gaussian_sigma_max, group.gaussian_sigma_max);
            chunk.extra_level_min = std::min(chunk.extra_level_min, group.extra_level_min);
            chunk.extra_level_max = std::max(chunk.extra_level_max, group.extra_level_max);
            m_groups.push_back(group);
        }
        all_anchors.store(chunk.anchor_min, chunk.anchor_max);
        all_gaussians.store(chunk.gaussian_min, chunk.gaussian_max);
        chunk.group_count = uint32_t(m_groups.size()) - chunk.group_first;
    }

    // note: exp() differs by an ulp between C libraries; the slack, rounded to 2^-10, hides that from the bytes
    void addBounds(const Anchor& a, const LevelRecord& level, GroupRecord& group, Box& anchors, Box& gaussians) const
    {
        const auto up = [](double v) { return float(std::ceil(v * 1024 + 0.5) / 1024); };
        const auto down = [](double v) { return float(std::floor(v * 1024 - 0.5) / 1024); };
        for (uint32_t axis = 0; axis < 3; ++axis) {
            const float at = coordinate(a, level, axis);
            anchors.add(axis, at, at);
            for (uint32_t k = 0; k < m_options.n_offsets; ++k) {
                const double centre = double(at) + double(a.offset[3 * k + axis]) * std::exp(double(a.scale[axis]));
                gaussians.add(axis, down(centre), up(centre));
            }
            group.anchor_sigma_max = std::max(group.anchor_sigma_max, up(std::exp(double(a.scale[axis]))));
            group.gaussian_sigma_max = std::max(group.gaussian_sigma_max, up(std::exp(double(a.scale[3 + axis]))));
        }
        group.extra_level_min = std::min(group.extra_level_min, a.extra_level);
        group.extra_level_max = std::max(group.extra_level_max, a.extra_level);
    }

    void makeGrid(LevelRecord& level)
    {
        const std::span<LeafRecord> leaves(m_leaves.data() + level.leaf_first, size_t(level.leaf_count));
        // any permutation does where there are no nodes; this one shows a reader that takes it for the identity
        for (uint32_t i = 0; i < leaves.size(); ++i)
            leaves[i].nanovdb_index = uint32_t(leaves.size()) - 1 - i;
        std::vector<std::byte> grid;
        if (m_options.build_grid) {
            grid = m_options.build_grid(level, leaves);
        } else {
            grid.resize(672 + 64); // nanovdb::GridData, nanovdb::TreeData
            const auto put = [&](size_t offset, auto value) {
                std::memcpy(grid.data() + offset, &value, sizeof(value));
            };
            put(0, uint64_t(0x304244566f6e614e)); // "NanoVDB0"
            put(16, uint32_t(32u << 21 | 4u << 10 | 2u));
            put(28, uint32_t(1)); // grid count
            put(32, uint64_t(grid.size()));
            put(672 + 32, uint32_t(level.leaf_count));
        }
        level.nanovdb_offset = m_grids.size();
        level.nanovdb_bytes = grid.size();
        m_grids.insert(m_grids.end(), grid.begin(), grid.end());
    }

    void finishParams()
    {
        m_params.chunk_count = m_chunks.size();
        m_params.group_count = m_groups.size();
        m_params.leaf_count = m_leaves.size();
        m_bounds.store(m_params.bounds_min, m_params.bounds_max);
        for (const ChunkRecord& chunk : m_chunks) {
            m_params.max_chunk_anchors = std::max(m_params.max_chunk_anchors, chunk.anchor_count);
            m_params.max_chunk_bytes = std::max(m_params.max_chunk_bytes, chunk.payload_bytes);
        }
    }

    // Halves of 1 + i mod 1024 / 1024 and their largest in the records.
    std::vector<AnchorSensitivity> sensitivities()
    {
        std::vector<AnchorSensitivity> values(m_anchors.size());
        for (uint32_t i = 0; i < values.size(); ++i)
            values[i] = {uint16_t(0x3c00 | i * 37 % 1024), uint16_t(0x3c00 | i * 11 % 1024)};
        for (GroupRecord& group : m_groups) {
            for (uint32_t i = group.anchor_first; i < group.anchor_first + group.anchor_count; ++i)
                group.view_sensitivity =
                    std::max(group.view_sensitivity, 1 + float(values[i].direction & 0x3ff) / 1024);
            float& all = m_chunks[group.chunk].view_sensitivity;
            all = std::max(all, group.view_sensitivity);
        }
        return values;
    }

    std::vector<std::byte> embedding()
    {
        const uint32_t rows = m_options.appearance_rows, columns = m_options.appearance_dim;
        const size_t values_at = size_t(alignUp(rows * sizeof(uint32_t), 64));
        std::vector<std::byte> out(values_at + size_t(rows) * columns * sizeof(float));
        for (uint32_t i = 0; i < rows; ++i) {
            const uint32_t source = 2 * i + 1;
            std::memcpy(out.data() + i * sizeof(uint32_t), &source, sizeof(source));
        }
        for (size_t i = 0; i < size_t(rows) * columns; ++i) {
            const float value = uniform(-1, 1);
            std::memcpy(out.data() + values_at + i * sizeof(float), &value, sizeof(value));
        }
        return out;
    }

    [[nodiscard]] std::vector<std::byte> cameras() const
    {
        std::vector<CameraRecord> list(m_options.cameras);
        std::string names;
        for (uint32_t i = 0; i < list.size(); ++i) {
            const std::string name = "view_" + std::to_string(i);
            CameraRecord& camera = list[i];
            camera.position[2] = -4.0 - i;
            for (uint32_t axis = 0; axis < 3; ++axis)
                camera.rotation[4 * axis] = 1;
            camera.fx = camera.fy = 100;
            camera.width = 160;
            camera.height = 120;
            camera.id = int32_t(i);
            camera.appearance = m_options.appearance_dim > 0 ? int32_t(i) : -1;
            camera.name_offset = uint32_t(names.size());
            camera.name_bytes = uint32_t(name.size());
            camera.is_test = i == 0;
            names += name;
        }
        std::vector<std::byte> out = bytesOf(list);
        const auto text = std::as_bytes(std::span(names));
        out.insert(out.end(), text.begin(), text.end());
        return out;
    }

    TinyGscOptions m_options;
    std::mt19937_64 m_random;
    ModelParams m_params{};
    std::vector<Anchor> m_anchors; // in file order
    std::vector<uint32_t> m_index;
    std::vector<LevelRecord> m_levels;
    std::vector<ChunkRecord> m_chunks;
    std::vector<GroupRecord> m_groups;
    std::vector<LeafRecord> m_leaves;
    std::vector<std::byte> m_payloads, m_grids;
    Box m_bounds;
};

} // namespace

std::vector<std::byte> tinyGsc(const TinyGscOptions& options)
{
    return Builder(options).build();
}

} // namespace gsc::test
