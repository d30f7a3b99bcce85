// SPDX-License-Identifier: Apache-2.0
#include "convert/write/chunk_build.h"

#include "convert/survey/chunk_values.h"
#include "convert/write/anchor_record.h"
#include <gsc/checksum.h>
#include "format/numbers/morton.h"

#include <algorithm>
#include <array>
#include <cfloat>
#include <cmath>
#include <cstring>

namespace gsc {

namespace {

// The renderer computes a + offset * exp(scale) in fp32 with an exp() that is off by a few ulps. So bounds are computed
// in double and widened by more than its rounding: by 16 ulps of the product and 4 of the sum.
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

template <typename Record> // ChunkRecord and GroupRecord have fields of these names
void clearBounds(Record& record)
{
    std::fill_n(record.anchor_min, 3, FLT_MAX);
    std::fill_n(record.anchor_max, 3, -FLT_MAX);
    std::fill_n(record.gaussian_min, 3, FLT_MAX);
    std::fill_n(record.gaussian_max, 3, -FLT_MAX);
    record.extra_level_min = FLT_MAX;
    record.extra_level_max = -FLT_MAX;
}

void addBounds(ChunkRecord& chunk, const GroupRecord& group)
{
    for (int axis = 0; axis < 3; ++axis) {
        chunk.anchor_min[axis] = std::min(chunk.anchor_min[axis], group.anchor_min[axis]);
        chunk.anchor_max[axis] = std::max(chunk.anchor_max[axis], group.anchor_max[axis]);
        chunk.gaussian_min[axis] = std::min(chunk.gaussian_min[axis], group.gaussian_min[axis]);
        chunk.gaussian_max[axis] = std::max(chunk.gaussian_max[axis], group.gaussian_max[axis]);
    }
    chunk.anchor_sigma_max = std::max(chunk.anchor_sigma_max, group.anchor_sigma_max);
    chunk.gaussian_sigma_max = std::max(chunk.gaussian_sigma_max, group.gaussian_sigma_max);
    chunk.extra_level_min = std::min(chunk.extra_level_min, group.extra_level_min);
    chunk.extra_level_max = std::max(chunk.extra_level_max, group.extra_level_max);
}

class Builder {
public:
    Builder(const ModelParams& params, const LevelRecord& level, const ChunkRecord& chunk)
        : m_params(params), m_level(level), m_chunk(chunk), m_record(anchorRecordLayout(params))
    {
    }

    // Sort keys of the records: Morton key of the cell within the chunk in the high half, number of the record in the
    // low half. They sort by leaf, then cell, then source index.
    [[nodiscard]] std::vector<uint64_t> sortedKeys(std::span<const std::byte> records) const
    {
        std::vector<uint64_t> keys(m_chunk.anchor_count);
        for (uint32_t i = 0; i < keys.size(); ++i) {
            const std::array<uint32_t, 3> local = localOf(records.data() + size_t(i) * m_record.bytes);
            const uint32_t shift = m_level.cell_log2;
            keys[i] = mortonEncode(local[0] >> shift, local[1] >> shift, local[2] >> shift) << 32 | i;
        }
        std::sort(keys.begin(), keys.end());
        return keys;
    }

    void gather(std::span<const std::byte> records, std::span<const uint64_t> keys, std::span<std::byte> payload) const
    {
        const ChunkArrayLayout layout = chunkArrayLayout(m_params, m_chunk.anchor_count);
        for (uint32_t a = 0; a < uint32_t(ChunkArray::Count); ++a) {
            const uint32_t stride = m_record.stride[a];
            for (size_t i = 0; stride != 0 && i < keys.size(); ++i)
                std::memcpy(payload.data() + layout.offset[a] + i * stride,
                            records.data() + size_t(uint32_t(keys[i])) * m_record.bytes + m_record.offset[a], stride);
        }
    }

    // Sets the bounds of a group: its group.anchor_count anchors begin with number `first` of the chunk.
    void setBounds(const ChunkValues& anchors, uint32_t first, GroupRecord& group) const
    {
        clearBounds(group);
        float anchor_scale = -INFINITY, gaussian_scale = -INFINITY; // natural logarithms
        for (uint32_t i = first; i < first + group.anchor_count; ++i) {
            const std::array<float, 3> position = anchors.position(i);
            const float* scale = anchors.values(ChunkArray::Scale, i);
            const float* offset = anchors.values(ChunkArray::Offset, i);
            for (int axis = 0; axis < 3; ++axis) {
                float low = FLT_MAX, high = -FLT_MAX;
                for (uint32_t k = 0; k < m_params.n_offsets; ++k) {
                    // note: offsets of a masked slot are NaN, which neither comparison takes
                    low = std::min(low, offset[3 * k + axis]);
                    high = std::max(high, offset[3 * k + axis]);
                }
                if (low > high) // all slots are masked
                    low = high = 0;
                const double a = position[axis], extent = std::exp(double(scale[axis]));
                const double near = low * extent, far = high * extent;
                const double slack = std::max(std::fabs(near), std::fabs(far)) * kProductSlack +
                                     (std::fabs(a) + std::max(std::fabs(near), std::fabs(far))) * kSumSlack;
                group.anchor_min[axis] = std::min(group.anchor_min[axis], position[axis]);
                group.anchor_max[axis] = std::max(group.anchor_max[axis], position[axis]);
                group.gaussian_min[axis] = std::min(group.gaussian_min[axis], roundDown(a + near - slack));
                group.gaussian_max[axis] = std::max(group.gaussian_max[axis], roundUp(a + far + slack));
                anchor_scale = std::max(anchor_scale, scale[axis]);
                gaussian_scale = std::max(gaussian_scale, scale[3 + axis]);
            }
            const float* stored_extra = anchors.values(ChunkArray::ExtraLevel, i);
            const float extra = stored_extra ? *stored_extra : 0;
            group.extra_level_min = std::min(group.extra_level_min, extra);
            group.extra_level_max = std::max(group.extra_level_max, extra);
        }
        group.anchor_sigma_max = sigmaBound(anchor_scale);
        group.gaussian_sigma_max = sigmaBound(gaussian_scale);
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
    // Position of a record's anchor in quanta from the origin of the chunk.
    [[nodiscard]] std::array<uint32_t, 3> localOf(const std::byte* record) const
    {
        if (m_params.position_encoding == uint32_t(PositionEncoding::Grid)) {
            GridPosition position;
            std::memcpy(&position, record, sizeof(position));
            return {position.local[0], position.local[1], position.local[2]};
        }
        float position[3];
        std::memcpy(position, record, sizeof(position));
        const QuantaPosition at = placeAnchor(PositionEncoding::Float, m_level, position);
        std::array<uint32_t, 3> local{};
        for (size_t axis = 0; axis < 3; ++axis)
            local[axis] = uint32_t(at.quanta[axis] - m_chunk.origin[axis]);
        return local;
    }

    const ModelParams& m_params;
    const LevelRecord& m_level;
    const ChunkRecord& m_chunk;
    AnchorRecordLayout m_record;
};

} // namespace

void buildChunk(const ModelParams& params, const LevelRecord& level, uint32_t chunk_index,
                std::span<const std::byte> records, ChunkRecord& chunk, std::span<std::byte> payload,
                std::span<GroupRecord> groups, std::vector<LeafBuild>& leaves, std::span<uint32_t> index)
{
    const Builder builder(params, level, chunk);
    const std::vector<uint64_t> keys = builder.sortedKeys(records);
    builder.gather(records, keys, payload);
    chunk.checksum = checksum64(payload);
    builder.addLeaves(keys, leaves);
    chunk.leaf_count = uint32_t(leaves.size());

    const ChunkValues anchors(params, chunk, level.quantum, level.origin, payload);
    clearBounds(chunk);
    for (uint32_t g = 0; g < groups.size(); ++g) {
        const uint32_t first = g * kGroupSize;
        GroupRecord& group = groups[g];
        group = {};
        group.anchor_first = chunk.anchor_first + first;
        group.chunk = chunk_index;
        group.anchor_count = uint16_t(std::min(kGroupSize, chunk.anchor_count - first));
        group.level_index = uint16_t(chunk.level_index);
        builder.setBounds(anchors, first, group);
        addBounds(chunk, group);
    }

    for (uint32_t i = 0; i < chunk.anchor_count; ++i)
        index[anchors.source(i)] = chunk.anchor_first + i;
}

} // namespace gsc
