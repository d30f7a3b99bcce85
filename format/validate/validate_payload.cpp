// SPDX-License-Identifier: Apache-2.0
// Checks ANCH: the chunk payloads, and that the records about them are true.
#include "format/numbers/compact.h"
#include "format/validate/gsc_validate.h"
#include <gsc/interrupt.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <limits>

namespace gsc::validate {

namespace {

constexpr uint16_t kKnownPositionFlags = kNegativeZeroX | kNegativeZeroY | kNegativeZeroZ;

// Checks the payload of one chunk, whose ranges are known to be sound.
class PayloadCheck {
public:
    PayloadCheck(Context& context, uint32_t chunk_index)
        : m_log(context.log), m_view(context.view), m_chunk(context.view.chunks[chunk_index]),
          m_level(context.view.levels[m_chunk.level_index]), m_chunk_index(chunk_index),
          m_layout(chunkArrayLayout(*m_view.params, m_chunk.anchor_count)), m_payload(chunkPayload(m_view, m_chunk)),
          m_payload_at(context.offsetOf(kSectionAnchors) + m_chunk.payload_offset),
          m_has_grid(m_view.params->position_encoding == uint32_t(PositionEncoding::Grid))
    {
    }

    void run()
    {
        checkChunkChecksum(m_log, m_chunk, m_chunk_index, m_payload, m_payload_at);
        checkSourceIndices();
        if (m_has_grid)
            for (uint32_t i = 0; i < m_chunk.leaf_count; ++i)
                checkLeaf(m_view.leaves[m_chunk.leaf_first + i]);
        for (uint32_t i = 0; i < m_chunk.group_count; ++i)
            checkGroup(m_view.groups[m_chunk.group_first + i]);
    }

    // Reports bytes between the arrays that are not zero.
    template <typename Report>
    void checkPadding(const Report& report) const
    {
        uint64_t end = 0;
        for (uint32_t i = 0; i < uint32_t(ChunkArray::Count); ++i) {
            const uint64_t next = std::min(m_layout.offset[i], m_layout.bytes);
            report(m_chunk.payload_offset + end, m_payload.subspan(size_t(end), size_t(next - end)));
            end = std::min(m_layout.offset[i] + m_layout.stride[i] * m_chunk.anchor_count, m_layout.bytes);
        }
    }

private:
    // Value of an anchor in an array of the payload, null if the array is absent. `local` is counted from the chunk's
    // first anchor.
    template <typename T>
    [[nodiscard]] const T* at(ChunkArray array, uint32_t local) const
    {
        const uint32_t a = uint32_t(array);
        return reinterpret_cast<const T*>(m_payload.data() + m_layout.offset[a] + m_layout.stride[a] * local);
    }
    [[nodiscard]] uint64_t fileOffset(ChunkArray array, uint32_t local) const
    {
        return m_payload_at + m_layout.offset[uint32_t(array)] + m_layout.stride[uint32_t(array)] * local;
    }
    [[nodiscard]] bool has(ChunkArray array) const { return m_layout.stride[uint32_t(array)] != 0; }
    [[nodiscard]] std::string where(uint32_t local, const char* field) const
    {
        return place("anchors", uint64_t(m_chunk.anchor_first) + local, field);
    }

    void checkSourceIndices() const
    {
        const uint32_t* const source = at<uint32_t>(ChunkArray::SourceIndex, 0);
        for (uint32_t i = 0; i < m_chunk.anchor_count; ++i) {
            if (source[i] >= m_view.index.size())
                GSC_REPORT(m_log, SourceIndexRange, fileOffset(ChunkArray::SourceIndex, i), where(i, "source_index"),
                           source[i], uint64_t(m_view.index.size()));
            else if (m_view.index[source[i]] != m_chunk.anchor_first + i)
                GSC_REPORT(m_log, SourceIndexMismatch, fileOffset(ChunkArray::SourceIndex, i), where(i, "source_index"),
                           source[i], m_view.index[source[i]]);
        }
    }

    // Checks that the anchors of a leaf lie in it. Only for grid positions: for an anchor stored as floats the leaf
    // depends on the writer's rounding.
    void checkLeaf(const LeafRecord& leaf) const
    {
        const uint32_t shift = m_level.cell_log2;
        int64_t low[3];
        for (uint32_t axis = 0; axis < 3; ++axis)
            low[axis] = int64_t(leaf.origin[axis]) * (int64_t(1) << shift) - m_chunk.origin[axis];
        const int64_t span = int64_t(1) << (kLeafLog2 + shift);
        int32_t last_cell[3] = {};
        uint32_t last_source = 0;
        const uint32_t first = leaf.anchor_first - m_chunk.anchor_first;
        for (uint32_t i = first; i < first + leaf.anchor_count; ++i) {
            const GridPosition& position = *at<GridPosition>(ChunkArray::Position, i);
            int32_t cell[3];
            for (uint32_t axis = 0; axis < 3; ++axis) {
                const int64_t local = position.local[axis];
                if (local < low[axis] || local >= low[axis] + span)
                    GSC_REPORT(m_log, PositionLeaf, fileOffset(ChunkArray::Position, i), where(i, "position"), axis,
                               position.local[axis], low[axis], low[axis] + span - 1);
                cell[axis] = int32_t(local >> shift);
            }
            const uint32_t source = *at<uint32_t>(ChunkArray::SourceIndex, i);
            const bool same_cell = std::equal(std::begin(cell), std::end(cell), std::begin(last_cell));
            if (i > first && (same_cell ? source <= last_source : !mortonLess(last_cell, cell)))
                GSC_REPORT(m_log, AnchorOrder, fileOffset(ChunkArray::Position, i), where(i, "position"),
                           "the anchor in front of it");
            std::copy(std::begin(cell), std::end(cell), std::begin(last_cell));
            last_source = source;
        }
    }

    // Checks the position of anchor `i` and returns it in `out`. Returns false if it cannot be used to place Gaussians.
    bool checkPosition(const GroupRecord& group, uint32_t i, float (&out)[3]) const
    {
        bool good = true;
        const uint16_t flags = m_has_grid ? at<GridPosition>(ChunkArray::Position, i)->flags : uint16_t(0);
        if (flags & ~kKnownPositionFlags)
            GSC_REPORT(m_log, PositionFlagBits, fileOffset(ChunkArray::Position, i), where(i, "position"), flags,
                       "unknown bits are set");
        for (uint32_t axis = 0; axis < 3; ++axis) {
            if (m_has_grid) {
                const int32_t quanta = m_chunk.origin[axis] + at<GridPosition>(ChunkArray::Position, i)->local[axis];
                out[axis] = gridCoordinate(quanta, m_level.quantum, m_level.origin, false);
                if ((flags & (kNegativeZeroX << axis)) && out[axis] != 0)
                    GSC_REPORT(m_log, PositionFlagBits, fileOffset(ChunkArray::Position, i), where(i, "position"),
                               flags, "a coordinate that is not zero is marked as -0");
            } else {
                out[axis] = at<float>(ChunkArray::Position, i)[axis];
            }
            if (!std::isfinite(out[axis])) {
                GSC_REPORT(m_log, PositionValue, fileOffset(ChunkArray::Position, i), where(i, "position"), axis,
                           double(out[axis]));
                good = false;
            } else if (out[axis] < group.anchor_min[axis] || out[axis] > group.anchor_max[axis]) {
                GSC_REPORT(m_log, PositionBounds, fileOffset(ChunkArray::Position, i), where(i, "position"), axis,
                           double(out[axis]), double(group.anchor_min[axis]), double(group.anchor_max[axis]));
            }
        }
        return good;
    }

    // Checks that exp() of every scale is finite and not above the group's bound. -inf is legal: a Gaussian of size
    // zero. `harmless`: up to this logarithm scale[3..5] are below the bound without computing exp().
    bool checkScale(const GroupRecord& group, float harmless, uint32_t i, double (&extent)[3]) const
    {
        const float* const scale = at<float>(ChunkArray::Scale, i);
        bool good = true;
        for (uint32_t c = 0; c < 6; ++c) {
            if (c >= 3 && scale[c] <= harmless)
                continue;
            const double sigma = std::exp(double(scale[c]));
            if (c < 3)
                extent[c] = sigma;
            const float bound = c < 3 ? group.anchor_sigma_max : group.gaussian_sigma_max;
            if (!(sigma <= double(std::numeric_limits<float>::max()))) { // true for NaN too
                GSC_REPORT(m_log, ScaleValue, fileOffset(ChunkArray::Scale, i) + 4 * c, where(i, "scale"), c,
                           double(scale[c]));
                good = false;
            } else if (sigma > double(bound)) {
                GSC_REPORT(m_log, SigmaBound, fileOffset(ChunkArray::Scale, i) + 4 * c, where(i, "scale"), c, sigma,
                           double(bound));
            }
        }
        return good;
    }

    bool checkFinite(ChunkArray array, uint32_t i, const char* field) const
    {
        const uint32_t count = uint32_t(m_layout.stride[uint32_t(array)] / sizeof(float));
        const float* const values = at<float>(array, i);
        if (allFinite({values, count}))
            return true;
        for (uint32_t k = 0; k < count; ++k)
            if (!std::isfinite(values[k]))
                GSC_REPORT(m_log, AttributeValue, fileOffset(array, i) + 4 * k, where(i, field), field, k,
                           double(values[k]));
        return false;
    }

    // Checks that the offsets of every slot are finite, or, in a model with masked slots, all three kMaskedOffset.
    // Returns false if one was reported.
    bool checkOffsets(uint32_t i) const
    {
        if (!hasMasks())
            return checkFinite(ChunkArray::Offset, i, "offset");
        const float* const values = at<float>(ChunkArray::Offset, i);
        bool good = true;
        for (uint32_t k = 0; k < 3 * m_view.params->n_offsets; k += 3) {
            if (isMasked(values + k) || allFinite({values + k, 3}))
                continue;
            good = false;
            for (uint32_t c = k; c < k + 3; ++c)
                if (!std::isfinite(values[c]))
                    GSC_REPORT(m_log, AttributeValue, fileOffset(ChunkArray::Offset, i) + 4 * c, where(i, "offset"),
                               "offset", c, double(values[c]));
        }
        return good;
    }

    [[nodiscard]] bool hasMasks() const { return (m_view.params->flags & kModelMaskedSlots) != 0; }

    static bool isMasked(const float* offset)
    {
        return std::bit_cast<uint32_t>(offset[0]) == kMaskedOffset &&
               std::bit_cast<uint32_t>(offset[1]) == kMaskedOffset &&
               std::bit_cast<uint32_t>(offset[2]) == kMaskedOffset;
    }

    // Checks that the centres of the anchor's Gaussians, computed in double, lie in the group's box, which must leave
    // room for the rounding of any renderer.
    void checkGaussians(const GroupRecord& group, uint32_t i, const float (&position)[3],
                        const double (&extent)[3]) const
    {
        const float* const offset = at<float>(ChunkArray::Offset, i);
        const uint32_t count = 3 * m_view.params->n_offsets;
        const auto outside = [&](uint32_t axis, float value) {
            const double centre = double(position[axis]) + double(value) * extent[axis];
            return centre < double(group.gaussian_min[axis]) || centre > double(group.gaussian_max[axis]);
        };
        // the centre grows with the offset, so on each axis the smallest and the largest offset are enough
        constexpr float kInfinity = std::numeric_limits<float>::infinity();
        float low[3] = {kInfinity, kInfinity, kInfinity}, high[3] = {-kInfinity, -kInfinity, -kInfinity};
        for (uint32_t c = 0; c < count; c += 3)
            for (uint32_t axis = 0; axis < 3; ++axis) {
                // note: the offset of a masked slot is NaN, which neither comparison takes
                low[axis] = std::min(low[axis], offset[c + axis]);
                high[axis] = std::max(high[axis], offset[c + axis]);
            }
        if (low[0] > high[0])
            return; // all slots are masked
        bool good = true;
        for (uint32_t axis = 0; axis < 3; ++axis)
            good &= !outside(axis, low[axis]) && !outside(axis, high[axis]);
        for (uint32_t c = 0; c < count && !good; ++c)
            if (outside(c % 3, offset[c])) // false for a masked slot
                GSC_REPORT(m_log, GaussianBounds, fileOffset(ChunkArray::Offset, i) + 4 * c, where(i, "offset"), c / 3,
                           c % 3, double(position[c % 3]) + double(offset[c]) * extent[c % 3],
                           double(group.gaussian_min[c % 3]), double(group.gaussian_max[c % 3]));
    }

    // Checks that the values of a compact model are whole numbers of the anchor's step (format/numbers/compact.h).
    void checkSteps(ChunkArray array, uint32_t i, uint32_t count, int bits, const char* name) const
    {
        const std::span<const float> values(at<float>(array, i), count);
        float largest = 0;
        for (const float v : values)
            largest = std::isfinite(v) ? std::max(largest, std::fabs(v)) : largest;
        const int power = compactExponent(largest, bits);
        for (uint32_t c = 0; c < count; ++c) {
            // the number of steps of each value is small enough if that of the largest one is
            const double steps = std::ldexp(double(values[c]), -power);
            if (std::isfinite(values[c]) && steps != std::nearbyint(steps))
                GSC_REPORT(m_log, CompactValue, fileOffset(array, i) + 4 * c, where(i, name), name, c,
                           double(values[c]), power, (1 << bits) - 1);
        }
    }

    void checkGroup(const GroupRecord& group) const
    {
        const uint32_t first = group.anchor_first - m_chunk.anchor_first;
        const float harmless = float(std::log(double(group.gaussian_sigma_max)) - 1e-4);
        for (uint32_t i = first; i < first + group.anchor_count; ++i) {
            float position[3];
            double extent[3];
            bool placed = checkPosition(group, i, position);
            placed &= checkScale(group, harmless, i, extent);
            placed &= checkOffsets(i);
            if (placed)
                checkGaussians(group, i, position, extent);
            checkFinite(ChunkArray::Feature, i, "feature");
            if (m_view.params->flags & kModelCompact) {
                checkSteps(ChunkArray::Feature, i, m_view.params->feat_dim, kCompactFeatureBits, "feature");
                checkSteps(ChunkArray::Offset, i, 3 * m_view.params->n_offsets, kCompactOffsetBits, "offset");
            }
            if (has(ChunkArray::Rotation))
                checkFinite(ChunkArray::Rotation, i, "rotation");
            if (has(ChunkArray::ExtraLevel)) {
                const float extra = *at<float>(ChunkArray::ExtraLevel, i);
                if (!(extra >= group.extra_level_min && extra <= group.extra_level_max))
                    GSC_REPORT(m_log, ExtraLevelValue, fileOffset(ChunkArray::ExtraLevel, i), where(i, "extra_level"),
                               double(extra), double(group.extra_level_min), double(group.extra_level_max));
            }
        }
    }

    IssueLog& m_log;
    const GscView& m_view;
    const ChunkRecord& m_chunk;
    const LevelRecord& m_level;
    uint32_t m_chunk_index;
    ChunkArrayLayout m_layout;
    std::span<const std::byte> m_payload;
    uint64_t m_payload_at; // byte offset of the payload in the file
    bool m_has_grid;
};

} // namespace

void checkPayloads(Context& context)
{
    const std::span<const std::byte> anchors = context.view.anchors;
    const auto padding = [&](uint64_t offset, std::span<const std::byte> bytes) {
        const size_t zeros = zeroPrefix(bytes);
        if (zeros != bytes.size())
            GSC_REPORT(context.log, PayloadPadding, context.offsetOf(kSectionAnchors) + offset + zeros, "",
                       offset + zeros, unsigned(bytes[zeros]));
    };
    uint64_t end = 0;
    for (uint32_t i = 0; i < context.view.chunks.size(); ++i) {
        throwIfInterrupted();
        const ChunkRecord& chunk = context.view.chunks[i];
        PayloadCheck check(context, i);
        check.run();
        check.checkPadding(padding);
        padding(end, anchors.subspan(size_t(end), size_t(chunk.payload_offset - end)));
        end = chunk.payload_offset + chunk.payload_bytes;
    }
    padding(end, anchors.subspan(size_t(end)));
}

} // namespace gsc::validate
