// SPDX-License-Identifier: Apache-2.0
#include "convert/grids/locate.h"

#include "convert/grids/stored_grid.h"
#include <gsc/interrupt.h>

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/gtc/type_ptr.hpp>

#include <algorithm>
#include <cmath>
#include <utility>

namespace gsc {

namespace {

using Point = glm::dvec3;

// Squared distance from the point to the box round the anchors of a chunk or a group; 0 inside.
template <typename Record>
double squaredGap(const Record& record, const Point& point)
{
    const Point low = glm::make_vec3(record.anchor_min), high = glm::make_vec3(record.anchor_max);
    const Point gap = glm::max(glm::max(low - point, 0.0), point - high);
    return dot(gap, gap);
}

uint32_t groupOf(const ChunkRecord& chunk, uint32_t local)
{
    return chunk.group_first + local / kGroupSize;
}

// Nearest anchor of a level. Chunks are searched from near to far, and in them only groups that may hold a nearer
// anchor.
std::optional<NearestAnchor> nearestAnchor(const GscView& view, const LevelRecord& level, const Point& point)
{
    std::vector<std::pair<double, uint32_t>> chunks;
    for (uint64_t c = level.chunk_first; c < level.chunk_first + level.chunk_count; ++c)
        chunks.emplace_back(squaredGap(view.chunks[c], point), uint32_t(c));
    std::sort(chunks.begin(), chunks.end());
    std::optional<NearestAnchor> nearest;
    double best = INFINITY; // squared distance in world units
    for (const auto& [gap, c] : chunks) {
        if (gap > best)
            break;
        throwIfInterrupted();
        const ChunkRecord& chunk = view.chunks[c];
        const ChunkValues anchors(view, chunk);
        for (uint32_t g = chunk.group_first; g < chunk.group_first + chunk.group_count; ++g) {
            const GroupRecord& group = view.groups[g];
            if (squaredGap(group, point) > best)
                continue;
            for (uint32_t anchor = group.anchor_first; anchor < group.anchor_first + group.anchor_count; ++anchor) {
                const auto position = anchors.position(anchor - chunk.anchor_first);
                const Point away = Point(glm::make_vec3(position.data())) - point;
                const double squared = dot(away, away);
                if (!(squared < best))
                    continue;
                best = squared;
                const uint32_t source = anchors.source(anchor - chunk.anchor_first);
                nearest = NearestAnchor{anchor, source, c, g, position, std::sqrt(squared)};
            }
        }
    }
    return nearest;
}

// Index in view.leaves of the leaf that leaf node number `ordinal` of the grid stands for; none if there is no such
// leaf.
std::optional<uint32_t> leafOf(const GscView& view, const LevelRecord& level, uint32_t ordinal)
{
    const auto leaves = view.leaves.subspan(level.leaf_first, level.leaf_count);
    const auto at = std::find_if(leaves.begin(), leaves.end(),
                                 [ordinal](const LeafRecord& leaf) { return leaf.nanovdb_index == ordinal; });
    return at == leaves.end() ? std::nullopt : std::optional(uint32_t(level.leaf_first + (at - leaves.begin())));
}

std::optional<uint32_t> chunkOf(const GscView& view, const LevelRecord& level, const std::array<int32_t, 3>& voxel)
{
    const uint32_t log2 = kChunkLog2 + level.cell_log2;
    for (uint64_t c = level.chunk_first; c < level.chunk_first + level.chunk_count; ++c) {
        const int32_t* origin = view.chunks[c].origin;
        if (std::equal(voxel.begin(), voxel.end(), origin,
                       [log2](int32_t v, int32_t o) { return v >> kChunkLog2 == o >> log2; }))
            return uint32_t(c);
    }
    return std::nullopt;
}

void lookUp(const GscView& view, const LevelRecord& level, const StoredGrid::Grid& grid, const Point& point,
            PlaceInLevel& place)
{
    std::array<int32_t, 3> voxel{};
    for (int i = 0; i < 3; ++i) {
        const double quanta = quantaAt(level, PositionEncoding(view.params->position_encoding), point[i]);
        if (!(std::fabs(quanta) < 0x1p30))
            return;
        voxel[size_t(i)] = int32_t(quanta) >> level.cell_log2;
    }
    place.voxel = voxel;
    place.chunk = chunkOf(view, level, voxel);
    const nanovdb::Coord coord(voxel[0], voxel[1], voxel[2]);
    const auto accessor = grid.getAccessor();
    const StoredGrid::Leaf* node = accessor.probeLeaf(coord);
    if (node == nullptr || !place.chunk)
        return;
    place.occupied = accessor.isActive(coord);
    place.leaf = leafOf(view, level, uint32_t(node - grid.tree().getFirstNode<0>()));
    const ChunkRecord& chunk = view.chunks[*place.chunk];
    if (!place.leaf || *place.leaf - chunk.leaf_first >= chunk.leaf_count)
        return place.leaf.reset(); // the grid does not belong to these records; gsc validate reports that
    const LeafRecord& leaf = view.leaves[*place.leaf];
    const uint32_t first = leaf.anchor_first - chunk.anchor_first;
    place.group_first = groupOf(chunk, first);
    place.group_count = groupOf(chunk, first + leaf.anchor_count - 1) - place.group_first + 1;
    const ChunkValues anchors(view, chunk);
    for (uint32_t i = first; i < first + leaf.anchor_count; ++i)
        place.anchors_in_voxel += cellOf(anchors, level, i) == voxel;
}

} // namespace

std::vector<PlaceInLevel> locate(const GscView& view, const std::array<double, 3>& point, const IssueSink& sink)
{
    const Point at = glm::make_vec3(point.data());
    std::vector<PlaceInLevel> places;
    for (uint32_t l = 0; l < view.levels.size(); ++l) {
        const StoredGrid stored(view, l, sink);
        if (stored.grid() == nullptr)
            break;
        PlaceInLevel place{};
        place.level_index = l;
        lookUp(view, view.levels[l], *stored.grid(), at, place);
        place.nearest = nearestAnchor(view, view.levels[l], at);
        places.push_back(place);
    }
    return places;
}

} // namespace gsc
