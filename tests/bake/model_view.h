// SPDX-License-Identifier: Apache-2.0
// An opened file as the stages of a frame read it, without the runtime.
#pragma once

#include "format/gsc_reader.h"
#include "kernels/frame/frame_types.h"

#include <vector>

namespace gsc::test {

// Valid as long as `view` and `arrays`, which is filled in. Positions are left out.
inline ModelView modelView(const GscView& view, std::vector<ChunkArrays>& arrays)
{
    arrays.clear();
    for (const ChunkRecord& chunk : view.chunks) {
        const ChunkArrayLayout layout = chunkArrayLayout(*view.params, chunk.anchor_count);
        const std::byte* payload = chunkPayload(view, chunk).data();
        const auto floats = [&](ChunkArray array) {
            return reinterpret_cast<const float*>(payload + layout.offset[uint32_t(array)]);
        };
        ChunkArrays a{};
        a.scale = floats(ChunkArray::Scale);
        a.feature = floats(ChunkArray::Feature);
        arrays.push_back(a);
    }
    return {view.params,
            view.levels.data(),
            view.chunks.data(),
            view.groups.data(),
            arrays.data(),
            view.weights.data(),
            view.packed.data(),
            view.embedding.empty() ? nullptr : view.embedding.data(),
            view.sensitivity.empty() ? nullptr : &view.sensitivity.data()->direction};
}

} // namespace gsc::test
