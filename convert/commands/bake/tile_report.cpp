// SPDX-License-Identifier: Apache-2.0
#include "convert/commands/bake/bake_report.h"

#include "runtime/cli/version.h"

namespace gsc {

namespace {

std::string orderText(const TileOptions& options, const TileReport& report)
{
    if (report.is_whole)
        return "all of the model that was cut, byte for byte";
    if (report.whole_anchors == report.anchors)
        return "all anchors of the model that was cut, in its order";
    if (report.whole_anchors > 0)
        return formatString("%s of %s of a model, in its order", formatCount(report.anchors).c_str(),
                            formatCount(report.whole_anchors, "anchor").c_str());
    return formatString("rows follow each other tile by tile, as given: %s was not cut from the model of the others",
                        options.names.back().c_str());
}

} // namespace

Json tilesJson(const TileOptions& options, const TileReport& report)
{
    Json tiles = Json::array();
    for (size_t i = 0; i < report.tiles.size(); ++i)
        tiles.push_back(
            {{"path", options.names[i]}, {"anchors", report.tiles[i].anchors}, {"kept", report.tiles[i].kept}});
    Json box = nullptr;
    if (options.crop)
        box = {{"from", options.crop->from}, {"to", options.crop->to}};
    return {{"schema", "gsc.tiles/1"},
            {"generator", {{"name", "gsc"}, {"version", toolVersion()}}},
            {"tiles", std::move(tiles)},
            {"crop", std::move(box)},
            {"output", options.output},
            {"bytes", report.bytes},
            {"anchors", report.anchors},
            {"whole_anchors", report.whole_anchors > 0 ? Json(report.whole_anchors) : Json(nullptr)},
            {"in_source_order", report.in_source_order},
            {"is_whole", report.is_whole},
            {"seconds", jsonNumber(report.seconds)},
            {"peak_memory_bytes", peakMemoryBytes()}};
}

std::string tilesText(const TileOptions& options, const TileReport& report)
{
    std::string text = formatString("wrote       %s, %s\n", options.output.c_str(), formatBytes(report.bytes).c_str());
    for (size_t i = 0; i < report.tiles.size(); ++i)
        text += formatString("kept        %s of %s of %s\n", formatCount(report.tiles[i].kept).c_str(),
                             formatCount(report.tiles[i].anchors, "anchor").c_str(), options.names[i].c_str());
    return text + "it is       " + orderText(options, report) + "\n";
}

} // namespace gsc
