// SPDX-License-Identifier: Apache-2.0
// False colours of Gaussians on the CPU. Splats are painted after projection, so that kept Gaussians keep their own
// colours.
#pragma once

#include "kernels/present/false_colour.h"
#include "kernels/project/project.h"

namespace gsc {

// Returns the false colour of the level of a chunk's anchors.
inline FalseColour chunkColour(const ModelView& model, uint32_t chunk)
{
    return levelColour(model.levels[model.chunks[chunk].level_index].level);
}

// Sets the colour of each of a block's splats to colourOf(the anchor's place in the block).
template <typename ColourOf>
void paintSplats(Splat* splats, const uint16_t* origins, uint32_t count, uint32_t n_offsets, const ColourOf& colourOf)
{
    for (uint32_t i = 0; i < count; ++i) {
        const FalseColour colour = colourOf(uint32_t(origins[i]) / n_offsets);
        splats[i].color[0] = colour.r;
        splats[i].color[1] = colour.g;
        splats[i].color[2] = colour.b;
    }
}

// Paints all splats in one colour.
inline void paintSplats(Splat* splats, uint32_t count, const FalseColour& colour)
{
    for (uint32_t i = 0; i < count; ++i) {
        splats[i].color[0] = colour.r;
        splats[i].color[1] = colour.g;
        splats[i].color[2] = colour.b;
    }
}

} // namespace gsc
