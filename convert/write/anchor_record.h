// SPDX-License-Identifier: Apache-2.0
// An anchor on its way into its chunk: the values of all its arrays one after the other, in the order of ChunkArray.
// A record is as large as the anchor's share of the payload, so that a chunk's records fit where its payload goes.
#pragma once

#include "convert/input/checkpoint.h"
#include <gsc/gsc_layout.h>

#include <cstddef>
#include <cstdint>
#include <vector>

namespace gsc {

struct AnchorRecordLayout {
    uint32_t offset[uint32_t(ChunkArray::Count)]; // offset of each array's value in the record
    uint32_t stride[uint32_t(ChunkArray::Count)]; // bytes, 0 = absent
    uint32_t bytes;
};

constexpr AnchorRecordLayout anchorRecordLayout(const ModelParams& params)
{
    const ChunkArrayLayout arrays = chunkArrayLayout(params, 0);
    AnchorRecordLayout layout{};
    for (uint32_t i = 0; i < uint32_t(ChunkArray::Count); ++i) {
        layout.offset[i] = layout.bytes;
        layout.stride[i] = uint32_t(arrays.stride[i]);
        layout.bytes += layout.stride[i];
    }
    return layout;
}

// Arrays of an anchor that are stored as the checkpoint has them.
struct CopiedArray {
    ChunkArray array;
    std::vector<float> AnchorBatch::*values;
    const char* name;
};
constexpr CopiedArray kCopiedArrays[] = {
    {ChunkArray::ExtraLevel, &AnchorBatch::extra_level, "extra_level"},
    {ChunkArray::Scale, &AnchorBatch::scale, "scale"},
    {ChunkArray::Offset, &AnchorBatch::offset, "offset"},
    {ChunkArray::Feature, &AnchorBatch::feature, "feature"},
    {ChunkArray::Rotation, &AnchorBatch::rotation, "rotation"},
    {ChunkArray::Opacity, &AnchorBatch::opacity, "opacity"},
    {ChunkArray::Normal, &AnchorBatch::normal, "normal"},
};

} // namespace gsc
