// SPDX-License-Identifier: Apache-2.0
// Reads the values of anchors from the payload of a chunk.
#pragma once

#include <gsc/gsc_reader.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace gsc {

class ChunkValues {
public:
    // `quantum`, `origin`: those of the chunk's level. `chunk` and `payload` must outlive this; the payload must be
    // aligned as in a file.
    ChunkValues(const ModelParams& params, const ChunkRecord& chunk, float quantum, float origin,
                std::span<const std::byte> payload)
        : m_layout(chunkArrayLayout(params, chunk.anchor_count)), m_chunk(&chunk), m_payload(payload.data()),
          m_quantum(quantum), m_origin(origin), m_on_grid(params.position_encoding == uint32_t(PositionEncoding::Grid))
    {
    }
    // Precondition: `view` came from openGsc() without errors; it must outlive this.
    ChunkValues(const GscView& view, const ChunkRecord& chunk)
        : ChunkValues(*view.params, chunk, view.levels[chunk.level_index].quantum,
                      view.levels[chunk.level_index].origin, chunkPayload(view, chunk))
    {
    }

    // The values of one anchor in an array; null if the file does not have the array. `local`: number of the anchor in
    // the chunk.
    template <typename T = float>
    [[nodiscard]] const T* values(ChunkArray array, uint32_t local) const
    {
        const uint64_t offset = m_layout.offset[uint32_t(array)], stride = m_layout.stride[uint32_t(array)];
        return stride != 0 ? reinterpret_cast<const T*>(m_payload + offset + stride * local) : nullptr;
    }

    [[nodiscard]] uint32_t source(uint32_t local) const { return *values<uint32_t>(ChunkArray::SourceIndex, local); }
    [[nodiscard]] bool onGrid() const { return m_on_grid; }

    // Position in quanta of the level. Precondition: onGrid().
    [[nodiscard]] std::array<int32_t, 3> quanta(uint32_t local) const
    {
        const uint16_t* stored = values<GridPosition>(ChunkArray::Position, local)->local;
        const int32_t* origin = m_chunk->origin;
        return {origin[0] + stored[0], origin[1] + stored[1], origin[2] + stored[2]};
    }

    // Position in world units, bit for bit as the trainer computed it.
    [[nodiscard]] std::array<float, 3> position(uint32_t local) const
    {
        if (!m_on_grid) {
            const float* stored = values(ChunkArray::Position, local);
            return {stored[0], stored[1], stored[2]};
        }
        const uint16_t flags = values<GridPosition>(ChunkArray::Position, local)->flags;
        const std::array<int32_t, 3> q = quanta(local);
        return {gridCoordinate(q[0], m_quantum, m_origin, (flags & kNegativeZeroX) != 0),
                gridCoordinate(q[1], m_quantum, m_origin, (flags & kNegativeZeroY) != 0),
                gridCoordinate(q[2], m_quantum, m_origin, (flags & kNegativeZeroZ) != 0)};
    }

private:
    ChunkArrayLayout m_layout;
    const ChunkRecord* m_chunk;
    const std::byte* m_payload;
    float m_quantum, m_origin;
    bool m_on_grid;
};

} // namespace gsc
