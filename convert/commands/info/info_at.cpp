// SPDX-License-Identifier: Apache-2.0
#include "convert/commands/info/info_at.h"

#include "convert/grids/locate.h"
#include "runtime/cli/options.h"

#include <charconv>
#include <cmath>
#include <limits>

namespace gsc {

namespace {

bool isInBounds(const ModelParams& params, const std::array<double, 3>& point)
{
    bool inside = true;
    for (size_t i = 0; i < 3; ++i)
        inside &= point[i] >= double(params.bounds_min[i]) && point[i] <= double(params.bounds_max[i]);
    return inside;
}

template <typename Value>
Json orNull(const std::optional<Value>& value)
{
    return value ? Json(*value) : Json(nullptr);
}

Json leafJson(const GscView& view, const PlaceInLevel& place)
{
    if (!place.leaf)
        return nullptr;
    const LeafRecord& leaf = view.leaves[*place.leaf];
    return {{"index", *place.leaf},
            {"origin", leaf.origin},
            {"anchor_first", leaf.anchor_first},
            {"anchor_count", leaf.anchor_count},
            {"group_first", place.group_first},
            {"group_count", place.group_count}};
}

Json nearestJson(const std::optional<NearestAnchor>& nearest)
{
    if (!nearest)
        return nullptr;
    return {{"anchor", nearest->anchor}, {"source", nearest->source},     {"chunk", nearest->chunk},
            {"group", nearest->group},   {"position", nearest->position}, {"distance", nearest->distance}};
}

std::string nodesText(const GscView& view, const PlaceInLevel& place)
{
    if (!place.voxel)
        return "beyond the grid";
    const auto& v = *place.voxel;
    std::string text = formatString("voxel (%d, %d, %d)", v[0], v[1], v[2]);
    if (!place.chunk)
        return text + ", no chunk there";
    if (!place.leaf)
        return text + formatString(", chunk %u, no leaf there", *place.chunk);
    const LeafRecord& leaf = view.leaves[*place.leaf];
    text += formatString(" with %s, chunk %u, leaf %u at (%d, %d, %d) with anchors %u to %u, group %u",
                         formatCount(place.anchors_in_voxel, "anchor").c_str(), *place.chunk, *place.leaf,
                         leaf.origin[0], leaf.origin[1], leaf.origin[2], leaf.anchor_first,
                         leaf.anchor_first + leaf.anchor_count - 1, place.group_first);
    return place.group_count == 1 ? text : text + formatString(" to %u", place.group_first + place.group_count - 1);
}

} // namespace

std::array<double, 3> parsePoint(const std::string& option, const std::string& text)
{
    std::array<double, 3> point{};
    const char* at = text.data();
    const char* const end = at + text.size();
    for (size_t i = 0; i < 3; ++i) {
        const auto [stop, error] = std::from_chars(at, end, point[i]);
        const bool last = i == 2;
        if (error != std::errc() || (last ? stop != end : stop == end || *stop != ',') ||
            !(std::fabs(point[i]) <= std::numeric_limits<float>::max()))
            detail::failValue(option, text, "no point",
                              "X,Y,Z: three finite numbers, world units, such as 1.5,-2,0.25");
        at = stop + 1;
    }
    return point;
}

Json atJson(const std::string& path, const GscView& view, const std::array<double, 3>& point)
{
    Json levels = Json::array();
    for (const PlaceInLevel& place : locate(view, point, throwFirstIssue(path)))
        levels.push_back({{"level", view.levels[place.level_index].level},
                          {"voxel", orNull(place.voxel)},
                          {"occupied", place.occupied},
                          {"anchors_in_voxel", place.anchors_in_voxel},
                          {"chunk", orNull(place.chunk)},
                          {"leaf", leafJson(view, place)},
                          {"nearest", nearestJson(place.nearest)}});
    return {{"point", point}, {"in_bounds", isInBounds(*view.params, point)}, {"levels", std::move(levels)}};
}

std::string atText(const std::string& path, const GscView& view, const std::array<double, 3>& point)
{
    std::string text = formatString("at          (%g, %g, %g), %s the model's bounds\n", point[0], point[1], point[2],
                                    isInBounds(*view.params, point) ? "inside" : "outside");
    for (const PlaceInLevel& place : locate(view, point, throwFirstIssue(path))) {
        text += formatString("level %-5d %s\n", view.levels[place.level_index].level, nodesText(view, place).c_str());
        if (const std::optional<NearestAnchor>& nearest = place.nearest)
            text += formatString("nearest     anchor %u (row %u of the checkpoint) at (%.9g, %.9g, %.9g), %.4g away; "
                                 "chunk %u, group %u\n",
                                 nearest->anchor, nearest->source, double(nearest->position[0]),
                                 double(nearest->position[1]), double(nearest->position[2]), nearest->distance,
                                 nearest->chunk, nearest->group);
    }
    return text;
}

} // namespace gsc
