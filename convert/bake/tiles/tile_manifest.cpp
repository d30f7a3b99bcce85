// SPDX-License-Identifier: Apache-2.0
#include "convert/bake/tiles/tile_manifest.h"

#include "convert/bake/model/gsc_checkpoint.h"
#include <gsc/error.h>

#include <algorithm>

namespace gsc {

namespace {

using Json = OrderedJson;

std::string hex(uint64_t value)
{
    return formatString("%016llx", (unsigned long long)value);
}

// The value of the key `name` of a manifest; null if there is none.
Json factOf(std::string_view manifest, const char* name)
{
    const Json json = manifestOf(manifest);
    return json.contains(name) ? json[name] : Json(nullptr);
}

// JSON of the box that is common to `box` and to the box of an earlier cut. `before`: the manifest's "crop" of that
// cut, or null.
Json boxJson(const CropBox& box, const Json& before)
{
    std::array<double, 3> from = box.from, to = box.to;
    if (before.is_object() && before.contains("box") && before["box"].is_array() && before["box"].size() == 6)
        for (size_t axis = 0; axis < 3; ++axis) {
            from[axis] =
                std::max(from[axis], before["box"][axis].is_number() ? before["box"][axis].get<double>() : from[axis]);
            to[axis] = std::min(to[axis],
                                before["box"][3 + axis].is_number() ? before["box"][3 + axis].get<double>() : to[axis]);
        }
    return {from[0], from[1], from[2], to[0], to[1], to[2]};
}

} // namespace

std::string tileFactsText(const TileFacts& facts)
{
    Json result = Json::object(), sources = Json::array(), reductions = Json::array(), crops = Json::array();
    for (const std::string_view manifest : facts.manifests) {
        sources.push_back(factOf(manifest, "source"));
        reductions.push_back(factOf(manifest, "reduction"));
        crops.push_back(factOf(manifest, "crop"));
    }
    result["source"] = sources[0].is_object() ? sources[0] : Json::object();
    if (!facts.one_model) {
        result["source"]["hash"] = hex(facts.source_hash);
        result["source"]["tiles"] = sources;
    }
    const auto isFirst = [&](const Json& reduction) { return reduction == reductions[0]; };
    if (!std::ranges::all_of(reductions, isFirst))
        result["reductions"] = reductions;
    else if (!reductions[0].is_null())
        result["reduction"] = reductions[0];
    if (facts.tile) {
        result["crop"] = {{"whole", hex(facts.tile->whole)}, {"whole_anchors", facts.tile->whole_anchors}};
        result["crop"]["box"] =
            facts.box ? boxJson(*facts.box, crops.size() == 1 ? crops[0] : Json(nullptr)) : Json(nullptr);
    }
    return result.dump();
}

} // namespace gsc
