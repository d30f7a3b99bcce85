// SPDX-License-Identifier: Apache-2.0
#include "convert/bake/chunk_build.h"

#include "convert/bake/anchor_record.h"
#include "convert/bake/morton.h"
#include "format/checksum.h"

#include <algorithm>
#include <cfloat>
#include <cmath>
#include <cstring>

namespace gsc {

namespace {

// The renderer computes a + offset * exp(scale) in fp32 with an exp of a few ulps; bounds are computed in double and
// widened by more than its rounding: 16 ulps of the product, 4 of the sum.
constexpr double kProductSlack = 0x1p-20, kSumSlack = 0x1p-22;

float roundDown(double value)
{
    const float f = float(std::clamp(value, double(-FLT_MAX), double(FLT_MAX)));
    return double(f) > value ? std::nextafter(f, -FLT_MAX) : f;
}

float roundUp(double value)
{
    const float f = float(std::clamp(value, double(-FLT_MAX), double(FLT_MAX)));
    return double(f) < value ? std::nextafter(f, FLT_MAX) : f;
}

float sigmaBound(float log_scale)
{
    return roundUp(std::exp(double(log_scale)) * (1 + kProductSlack));
}

struct Box {
    float min[3] = {FLT_MAX, FLT_MAX, FLT_MAX}, max[3] = {-FLT_MAX, -FLT_MAX, -FLT_MAX};

    void add(int axis, float low, float high)
    {
        min[axis] = std::min(min[axis], low);
        max[axis] = std::max(max[axis], high);
    }
};

struct Bounds {
    Box anchors, gaussians;
    float anchor_scale = -INFINITY, gaussian_scale = -INFINITY; // logs
    float extra_min = FLT_MAX, extra_max = -FLT_MAX;
};

void merge(Bounds& into, const Bounds& from)
{
    for (int axis = 0; axis < 3; ++axis) {
        into.anchors.add(axis, from.anchors.min[axis], from.anchors.max[axis]);
        into.gaussians.add(axis, from.gaussians.min[axis], from.gaussians.max[axis]);
    }
    into.anchor_scale = std::max(into.anchor_scale, from.anchor_scale);
    into.gaussian_scale = std::max(into.gaussian_scale, from.gaussian_scale);
    into.extra_min = std::min(into.extra_min, from.extra_min);
    into.extra_max = std::max(into.extra_max, from.extra_max);
}

template <typename Record> // ChunkRecord and GroupRecord name these alike
void storeBounds(const Bounds& bounds, Record& record)
{
    for (int axis = 0; axis < 3; ++axis) {
        record.anchor_min[axis] = bounds.anchors.min[axis];
        record.anchor_max[axis] = bounds.anchors.max[axis];
        record.gaussian_min[axis] = bounds.gaussians.min[axis];
        record.gaussian_max[axis] = bounds.gaussians.max[axis];
    }
    record.anchor_sigma_max = sigmaBound(bounds.anchor_scale);
    record.gaussian_sigma_max = sigmaBound(bounds.gaussian_scale);
    record.extra_level_min = bounds.extra_min;
    record.extra_level_max = bounds.extra_max;
}

// Typed access to the arrays of a payload. Every array is aligned to kArrayAlign, the buffer too.
class PayloadArrays {
public:
    PayloadArrays(const ModelParams& params, uint32_t count, std::span<std::byte> payload)
        : m_layout(chunkArrayLayout(params, count)), m_payload(payload)
    {
    }

    [[nodiscard]] const float* floats(ChunkArray array, uint32_t anchor) const
    {
        return reinterpret_cast<const float*>(bytes(array, anchor));
    }
    [[nodiscard]] std::byte* bytes(ChunkArray array, uint32_t anchor) const
    {
        return m_payload.data() + m_layout.offset[uint32_t(array)] + m_layout.stride[uint32_t(array)] * anchor;
    }
    [[nodiscard]] bool has(ChunkArray array) const { return m_layout.stride[uint32_t(array)] != 0; }

private:
    ChunkArrayLayout m_layout;
    std::span<std::byte> m_payload;
};

struct Local {
    uint32_t quanta[3]; // from the chunk's origin
};

class Builder {
public:
    Builder(const ModelParams& params, const LevelPlan& level, const ChunkRecord& chunk)
        : m_params(params), m_level(level), m_chunk(chunk), m_record(anchorRecordLayout(params))
    {
    }

    // Morton key of the cell in the chunk, above the place among the records: leaf, cell, source index in one number.
    [[nodiscard]] std::vector<uint64_t> sortedKeys(std::span<const std::byte> records) const
    {
        std::vector<uint64_t> keys(m_chunk.anchor_count);
        for (uint32_t i = 0; i < keys.size(); ++i) {
            const Local local = localOf(records.data() + size_t(i) * m_record.bytes);
            const uint32_t shift = m_level.cell_log2;
            keys[i] =
                mortonEncode(local.quanta[0] >> shift, local.quanta[1] >> shift, local.quanta[2] >> shift) << 32 | i;
        }
        std::sort(keys.begin(), keys.end());
        return keys;
    }

    void gather(std::span<const std::byte> records, std::span<const uint64_t> keys, std::span<std::byte> payload) const
    {
        const ChunkArrayLayout layout = chunkArrayLayout(m_params, m_chunk.anchor_count);
        uint64_t written = 0;
        for (uint32_t a = 0; a < uint32_t(ChunkArray::Count); ++a) {
            std::memset(payload.data() + written, 0, std::min(layout.offset[a], layout.bytes) - written);
            std::byte* out = payload.data() + layout.offset[a];
            const uint32_t stride = m_record.stride[a];
            if (stride)
                for (size_t i = 0; i < keys.size(); ++i)
                    std::memcpy(out + i * stride,
                                records.data() + size_t(uint32_t(keys[i])) * m_record.bytes + m_record.offset[a],
                                stride);
            written = std::min(layout.offset[a] + uint64_t(stride) * keys.size(), layout.bytes);
        }
    }

    [[nodiscard]] Bounds boundsOf(const PayloadArrays& arrays, uint32_t first, uint32_t count) const
    {
        Bounds bounds;
        for (uint32_t i = first; i < first + count; ++i) {
            float position[3];
            positionOf(arrays, i, position);
            const float* scale = arrays.floats(ChunkArray::Scale, i);
            const float* offset = arrays.floats(ChunkArray::Offset, i);
            for (int axis = 0; axis < 3; ++axis) {
                float low = offset[axis], high = offset[axis];
                for (uint32_t k = 1; k < m_params.n_offsets; ++k) {
                    low = std::min(low, offset[3 * k + axis]);
                    high = std::max(high, offset[3 * k + axis]);
                }
                const double a = position[axis], extent = std::exp(double(scale[axis]));
                const double near = low * extent, far = high * extent;
                const double slack = std::max(std::fabs(near), std::fabs(far)) * kProductSlack +
                                     (std::fabs(a) + std::max(std::fabs(near), std::fabs(far))) * kSumSlack;
                bounds.anchors.add(axis, position[axis], position[axis]);
                bounds.gaussians.add(axis, roundDown(a + near - slack), roundUp(a + far + slack));
                bounds.anchor_scale = std::max(bounds.anchor_scale, scale[axis]);
                bounds.gaussian_scale = std::max(bounds.gaussian_scale, scale[3 + axis]);
            }
            const float extra = arrays.has(ChunkArray::ExtraLevel) ? *arrays.floats(ChunkArray::ExtraLevel, i) : 0;
            bounds.extra_min = std::min(bounds.extra_min, extra);
            bounds.extra_max = std::max(bounds.extra_max, extra);
        }
        return bounds;
    }

    void addLeaves(std::span<const uint64_t> keys, std::vector<LeafBuild>& leaves) const
    {
        uint64_t last = ~0ull;
        for (uint32_t i = 0; i < keys.size(); ++i) {
            const uint64_t cell = keys[i] >> 32, leaf = cell >> 3 * kLeafLog2;
            if (leaf != last) {
                LeafBuild build{};
                build.record.anchor_first = m_chunk.anchor_first + i;
                for (int axis = 0; axis < 3; ++axis)
                    build.record.origin[axis] =
                        (m_chunk.origin[axis] >> m_level.cell_log2) + int32_t(gatherBits3(leaf >> axis) << kLeafLog2);
                leaves.push_back(build);
                last = leaf;
            }
            LeafBuild& build = leaves.back();
            ++build.record.anchor_count;
            const uint32_t x = gatherBits3(cell) & 7, y = gatherBits3(cell >> 1) & 7, z = gatherBits3(cell >> 2) & 7;
            build.cells[x] |= 1ull << (8 * y + z);
        }
    }

private:
    [[nodiscard]] Local localOf(const std::byte* record) const
    {
        Local local{};
        if (m_params.position_encoding == uint32_t(PositionEncoding::Grid)) {
            GridPosition position;
            std::memcpy(&position, record, sizeof(position));
            std::copy_n(position.local, 3, local.quanta);
        } else {
            float position[3];
            std::memcpy(position, record, sizeof(position));
            const QuantaPosition at = placeAnchor(PositionEncoding::Float, m_level, position);
            for (int axis = 0; axis < 3; ++axis)
                local.quanta[axis] = uint32_t(at.quanta[axis] - m_chunk.origin[axis]);
        }
        return local;
    }

    void positionOf(const PayloadArrays& arrays, uint32_t anchor, float position[3]) const
    {
        const std::byte* bytes = arrays.bytes(ChunkArray::Position, anchor);
        if (m_params.position_encoding == uint32_t(PositionEncoding::Float)) {
            std::memcpy(position, bytes, 3 * sizeof(float));
            return;
        }
        GridPosition grid;
        std::memcpy(&grid, bytes, sizeof(grid));
        for (int axis = 0; axis < 3; ++axis)
            position[axis] = gridCoordinate(m_chunk.origin[axis] + grid.local[axis], m_level.quantum, m_level.origin,
                                            grid.flags & (kNegativeZeroX << axis));
    }

    const ModelParams& m_params;
    const LevelPlan& m_level;
    const ChunkRecord& m_chunk;
    AnchorRecordLayout m_record;
};

} // namespace

void buildChunk(const ModelParams& params, const LevelPlan& level, uint32_t chunk_index,
                std::span<const std::byte> records, ChunkRecord& chunk, std::span<std::byte> payload,
                std::span<GroupRecord> groups, std::vector<LeafBuild>& leaves, std::span<uint32_t> index)
{
    const Builder builder(params, level, chunk);
    const std::vector<uint64_t> keys = builder.sortedKeys(records);
    builder.gather(records, keys, payload);
    chunk.checksum = checksum64(payload);
    builder.addLeaves(keys, leaves);
    chunk.leaf_count = uint32_t(leaves.size());

    const PayloadArrays arrays(params, chunk.anchor_count, payload);
    Bounds all;
    for (uint32_t g = 0; g < groups.size(); ++g) {
        const uint32_t first = g * kGroupSize, count = std::min(kGroupSize, chunk.anchor_count - first);
        const Bounds bounds = builder.boundsOf(arrays, first, count);
        GroupRecord& group = groups[g];
        group = {};
        storeBounds(bounds, group);
        group.anchor_first = chunk.anchor_first + first;
        group.chunk = chunk_index;
        group.anchor_count = uint16_t(count);
        group.level_index = uint16_t(chunk.level_index);
        merge(all, bounds);
    }
    storeBounds(all, chunk);

    for (uint32_t i = 0; i < chunk.anchor_count; ++i) {
        uint32_t source;
        std::memcpy(&source, arrays.bytes(ChunkArray::SourceIndex, i), sizeof(source));
        index[source] = chunk.anchor_first + i;
    }
}

} // namespace gsc
