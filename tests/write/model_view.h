// SPDX-License-Identifier: Apache-2.0
// An opened file as the stages of a frame read it, without the runtime.
#pragma once

#include <gsc/gsc_reader.h>
#include "kernels/math/anchor.h"

#include <vector>

namespace gsc::test {

// Valid as long as `view` and `arrays`, which is filled in.
inline ModelView modelView(const GscView& view, std::vector<ChunkArrays>& arrays)
{
    arrays.clear();
    for (const ChunkRecord& chunk : view.chunks)
        arrays.push_back(chunkArrays(*view.params, chunk.anchor_count, chunkPayload(view, chunk).data()));
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
