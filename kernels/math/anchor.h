// SPDX-License-Identifier: Apache-2.0
// Finds the arrays of a chunk, and reads one anchor from them.
#pragma once

#include <gsc/frame_types.h>
#include "kernels/math/real.h"

namespace gsc {

// Pointers to the arrays of a chunk whose payload lies at `payload`, in the mapped file or in a device's copy of it.
inline ChunkArrays chunkArrays(const ModelParams& params, uint32_t anchor_count, const std::byte* payload)
{
    const ChunkArrayLayout layout = chunkArrayLayout(params, anchor_count);
    const auto point = [&]<typename T>(const T*& to, ChunkArray array) {
        const auto i = uint32_t(array);
        to = layout.stride[i] > 0 ? reinterpret_cast<const T*>(payload + layout.offset[i]) : nullptr;
    };
    ChunkArrays arrays{};
    if (params.position_encoding == uint32_t(PositionEncoding::Grid))
        point(arrays.grid_position, ChunkArray::Position);
    else
        point(arrays.float_position, ChunkArray::Position);
    point(arrays.source_index, ChunkArray::SourceIndex);
    point(arrays.extra_level, ChunkArray::ExtraLevel);
    point(arrays.scale, ChunkArray::Scale);
    point(arrays.offset, ChunkArray::Offset);
    point(arrays.feature, ChunkArray::Feature);
    point(arrays.rotation, ChunkArray::Rotation);
    return arrays;
}

GSC_HD Vec3<float> anchorPosition(const ModelView& model, uint32_t chunk, uint32_t local)
{
    const ChunkArrays& arrays = model.arrays[chunk];
    if (arrays.float_position != nullptr) {
        const float* p = arrays.float_position + size_t(3) * local;
        return {p[0], p[1], p[2]};
    }
    const ChunkRecord& record = model.chunks[chunk];
    const LevelRecord& level = model.levels[record.level_index];
    const GridPosition g = arrays.grid_position[local];
    return {gridCoordinate(record.origin[0] + int32_t(g.local[0]), level.quantum, level.origin,
                           (g.flags & kNegativeZeroX) != 0),
            gridCoordinate(record.origin[1] + int32_t(g.local[1]), level.quantum, level.origin,
                           (g.flags & kNegativeZeroY) != 0),
            gridCoordinate(record.origin[2] + int32_t(g.local[2]), level.quantum, level.origin,
                           (g.flags & kNegativeZeroZ) != 0)};
}

GSC_HD int32_t anchorLevel(const ModelView& model, uint32_t chunk)
{
    return model.levels[model.chunks[chunk].level_index].level;
}

GSC_HD float anchorExtraLevel(const ModelView& model, uint32_t chunk, uint32_t local)
{
    const float* extra = model.arrays[chunk].extra_level;
    return extra != nullptr ? extra[local] : 0.0f;
}

// Quaternion of an anchor as stored, w x y z, not normalised.
GSC_HD const float* anchorRotation(const ModelView& model, uint32_t chunk, uint32_t local)
{
    const float* rotation = model.arrays[chunk].rotation;
    return rotation != nullptr ? rotation + size_t(4) * local : model.params->constant_rotation;
}

// Returns true if the slot with this offset is masked, so never drawn. `masks`: the model has kModelMaskedSlots.
GSC_HD bool isMaskedSlot(bool masks, const float* offset)
{
    return masks && offset[0] != offset[0];
}

// Number that orders Gaussians of equal depth: the trainers' code emits them in the order of the anchors in its file,
// and of the slots of an anchor (format facts, trap 28).
GSC_HD uint64_t emissionOrder(const ModelView& model, uint32_t chunk, uint32_t local, uint32_t k)
{
    return uint64_t(model.arrays[chunk].source_index[local]) * model.params->n_offsets + k;
}

} // namespace gsc
