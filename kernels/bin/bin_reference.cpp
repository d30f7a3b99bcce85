// SPDX-License-Identifier: Apache-2.0
#include "kernels/bin/bin.h"

namespace gsc {

template <typename Real>
TileLists binReference(const std::vector<SplatOf<Real>>& splats, const std::vector<uint32_t>& sorted, uint32_t grid_x,
                       uint32_t grid_y)
{
    TileLists lists;
    lists.first.assign(size_t(grid_x) * grid_y + 1, 0);
    const auto forEachTile = [&](auto&& body) {
        for (const uint32_t index : sorted) {
            const TileRect& rect = splats[index].tiles;
            for (int32_t y = rect.y0; y < rect.y1; ++y)
                for (int32_t x = rect.x0; x < rect.x1; ++x)
                    body(uint32_t(y) * grid_x + uint32_t(x), index);
        }
    };
    forEachTile([&](uint32_t tile, uint32_t) { ++lists.first[tile + 1]; });
    for (size_t tile = 1; tile < lists.first.size(); ++tile)
        lists.first[tile] += lists.first[tile - 1];
    lists.entries.resize(lists.first.back());
    std::vector<uint32_t> next(lists.first.begin(), lists.first.end() - 1);
    forEachTile([&](uint32_t tile, uint32_t index) { lists.entries[next[tile]++] = index; });
    return lists;
}

template TileLists binReference<float>(const std::vector<SplatOf<float>>&, const std::vector<uint32_t>&, uint32_t,
                                       uint32_t);
template TileLists binReference<double>(const std::vector<SplatOf<double>>&, const std::vector<uint32_t>&, uint32_t,
                                        uint32_t);

} // namespace gsc
