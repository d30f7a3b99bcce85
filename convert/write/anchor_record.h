// SPDX-License-Identifier: Apache-2.0
// One anchor while it is sorted into its chunk: its values of all arrays one after the other, in the order of
// ChunkArray. A record has as many bytes as the anchor takes in the payload, so that the records of a chunk fit where
// the payload will be.
#pragma once

#include "convert/input/checkpoint.h"
#include <gsc/gsc_layout.h>

#include <cstddef>
#include <cstdint>
#include <vector>

namespace gsc {

struct AnchorRecordLayout {
    uint32_t offset[uint32_t(ChunkArray::Count)]; // byte offset in a record of the anchor's value of each array
    // bytes of the anchor's value of each array; 0 = the file has no such array
    uint32_t stride[uint32_t(ChunkArray::Count)];
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

// Arrays whose values are copied from the checkpoint unchanged.
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
