// SPDX-License-Identifier: Apache-2.0
#include "kernels/blend/blend.h"

#include "kernels/present/false_colour.h"

namespace gsc {

template <typename Real>
uint64_t blendReference(const std::vector<SplatOf<Real>>& splats, const TileLists& lists, uint32_t width,
                        uint32_t height, const RasterConstants& rules, const float* background, Real* image,
                        const DepthRows<Real>& depth, const ColumnRange& columns, bool cost)
{
    const uint32_t grid_x = tileCount(width);
    const ColumnRange drawn = columns.within(width);
    uint64_t evaluations = 0;
    for (uint32_t y = 0; y < height; ++y)
        for (uint32_t x = drawn.first; x < drawn.end; ++x) {
            const uint32_t tile = y / kTileSize * grid_x + x / kTileSize;
            PixelState<Real> pixel{{0, 0, 0}, Real(1), false};
            Real z = INFINITY;
            uint32_t i = lists.first[tile];
            for (; i < lists.first[tile + 1] && !pixel.done; ++i) {
                const SplatOf<Real>& s = splats[lists.entries[i]];
                const Real before = pixel.transmittance;
                blendStep(rules, s.conic, s.x - Real(x), s.y - Real(y), s.opacity, s.color, pixel);
                if (before >= Real(kHalfLight) && pixel.transmittance < Real(kHalfLight))
                    z = s.depth;
            }
            evaluations += i - lists.first[tile];
            if (depth.z != nullptr)
                depth.z[y * depth.stride + x] = z;
            for (int c = 0; c < 3; ++c)
                image[(size_t(y) * width + x) * 3 + c] =
                    std::fma(pixel.transmittance, Real(background[c]), pixel.color[c]);
            if (cost) {
                const FalseColour colour = costColour(i - lists.first[tile]);
                const float rgb[3] = {colour.r, colour.g, colour.b};
                std::copy_n(rgb, 3, image + (size_t(y) * width + x) * 3);
            }
        }
    return evaluations;
}

template uint64_t blendReference<float>(const std::vector<SplatOf<float>>&, const TileLists&, uint32_t, uint32_t,
                                        const RasterConstants&, const float*, float*, const DepthRows<float>&,
                                        const ColumnRange&, bool);
template uint64_t blendReference<double>(const std::vector<SplatOf<double>>&, const TileLists&, uint32_t, uint32_t,
                                         const RasterConstants&, const float*, double*, const DepthRows<double>&,
                                         const ColumnRange&, bool);

} // namespace gsc
