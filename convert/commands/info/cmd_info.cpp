// SPDX-License-Identifier: Apache-2.0
#include "convert/commands/command.h"
#include "convert/commands/info/info_at.h"
#include "convert/commands/model_facts.h"

#include <gsc/gsc_file.h>
#include <gsc/gsc_reader.h>
#include "runtime/cameras/length.h"
#include "runtime/records/record.h"

#include <algorithm>
#include <optional>

namespace gsc {

namespace {

const SectionEntry* findSection(const GscView& view, uint32_t type)
{
    const auto found = std::ranges::find(view.sections, type, &SectionEntry::type);
    return found != view.sections.end() ? &*found : nullptr;
}

// The manifest's array of MLPs; an empty array if it has none.
Json mlpsOf(const Json& manifest)
{
    static const Json::json_pointer kPlace("/model/mlps");
    return manifest.is_object() && manifest.contains(kPlace) ? manifest[kPlace] : Json::array();
}

// Text of a value of the manifest, whatever its type; lists and objects are written without brackets.
std::string wordOf(const Json& value)
{
    constexpr size_t kMostWords = 16;
    if (value.is_string())
        return value.get<std::string>();
    if (!value.is_structured())
        return value.dump(-1, ' ', false, Json::error_handler_t::replace);
    if (value.size() > kMostWords)
        return formatCount(value.size(), "value");
    std::string words;
    for (const auto& [key, item] : value.items())
        words += (words.empty() ? "" : " ") + (value.is_object() ? key + " " : "") + wordOf(item);
    return words;
}

// One MLP in words, such as "opacity: feature, direction -> 35 -> 32 -> 10, tanh".
std::string mlpText(const Json& mlp)
{
    const auto text = [&mlp](const char* key) { return mlp.is_object() && mlp.contains(key) ? wordOf(mlp[key]) : "?"; };
    std::string inputs;
    if (mlp.is_object() && mlp.contains("inputs") && mlp["inputs"].is_array())
        for (const Json& input : mlp["inputs"])
            inputs += (inputs.empty() ? "" : ", ") + (input.is_string() ? input.get<std::string>() : "?");
    return text("kind") + ": " + inputs + " -> " + text("in") + " -> " + text("hidden") + " -> " + text("out") + ", " +
           text("activation");
}

// A JSON object as one line "key value, key value", whatever its values are.
std::string oneLine(const Json& object)
{
    std::string text;
    for (const auto& [key, value] : object.items())
        text +=
            (text.empty() ? "" : ", ") + key + " " +
            ((key == "anchors" || key == "dropped") && value.is_number_unsigned() ? formatCount(value.get<uint64_t>())
                                                                                  : wordOf(value));
    return text;
}

Json metreJson(const GscView& view)
{
    const std::optional<Metre> metre = metreOfManifest(view.manifest);
    return metre ? Json{{"units", metre->units}, {"rule", metre->rule}} : Json(nullptr);
}

std::string metreText(const GscView& view, const Json& manifest)
{
    if (const std::optional<Metre> metre = metreOfManifest(view.manifest))
        return formatString("metre       %.4g world units (%s)\n", metre->units, metre->rule.c_str());
    static const Json::json_pointer kPlace("/model/metre");
    const bool tried = manifest.is_object() && manifest.contains(kPlace);
    return tried ? "metre       none: the anchors are few or in one place\n"
                 : "metre       not in the file; gsc sample paths derives one\n";
}

Json point(const float (&values)[3])
{
    Json json = Json::array();
    for (const float value : values)
        json.push_back(jsonNumber(double(value)));
    return json;
}

// JSON of the report, from the header, the section table and sections META, PARM and LEVL, without reading the rest.
Json infoJson(const std::string& path, const GscFile& file, const GscView& view, const Json& manifest)
{
    const ModelParams& params = *view.params;
    Json levels = Json::array();
    for (const LevelRecord& level : view.levels)
        levels.push_back({{"level", level.level},
                          {"anchors", level.anchor_count},
                          {"chunks", level.chunk_count},
                          {"groups", level.group_count},
                          {"leaves", level.leaf_count},
                          {"quantum", jsonNumber(double(level.quantum))},
                          {"cell_log2", level.cell_log2}});
    Json bytes = Json::object();
    for (const SectionEntry& entry : view.sections)
        bytes[fourCcText(entry.type)] = entry.bytes;
    const SectionEntry* cameras = findSection(view, kSectionCameras);
    return {
        {"schema", "gsc.info/1"},
        {"path", path},
        {"format", "gsc"},
        {"version", formatString("%u.%u", unsigned(view.header->version_major), unsigned(view.header->version_minor))},
        {"profile", file.isArchive() ? "archive" : "runtime"},
        {"file_bytes", file.storedBytes()},
        {"runtime_bytes", view.header->file_bytes},
        {"source_hash", formatString("%016llx", static_cast<unsigned long long>(view.header->source_hash))},
        {"config_hash", formatString("%016llx", static_cast<unsigned long long>(view.header->config_hash))},
        {"model", modelJson(params, view.header->anchor_count)},
        {"positions", params.position_encoding == uint32_t(PositionEncoding::Grid) ? "grid" : "float"},
        {"compact", (params.flags & kModelCompact) != 0},
        {"bounds", {{"min", point(params.bounds_min)}, {"max", point(params.bounds_max)}}},
        {"levels", std::move(levels)},
        {"chunks",
         {{"count", params.chunk_count},
          {"max_anchors", params.max_chunk_anchors},
          {"max_bytes", params.max_chunk_bytes}}},
        {"groups", params.group_count},
        {"leaves", params.leaf_count},
        {"mlps", mlpsOf(manifest)},
        {"cameras", cameras ? cameras->count : 0},
        {"metre", metreJson(view)},
        {"sensitivity", findSection(view, kSectionSensitivity) != nullptr},
        {"bytes", std::move(bytes)},
        {"manifest", manifest},
    };
}

std::string infoText(const std::string& path, const GscFile& file, const GscView& view, const Json& manifest)
{
    const ModelParams& params = *view.params;
    std::string text =
        formatString("file        %s, %s, .gsc %u.%u\n", path.c_str(), formatBytes(file.storedBytes()).c_str(),
                     unsigned(view.header->version_major), unsigned(view.header->version_minor));
    if (file.isArchive())
        text += formatString("archive     of a file of %s, whose sections follow\n",
                             formatBytes(view.header->file_bytes).c_str());
    text += modelText(params, view.header->anchor_count) + "\n";
    text += formatString("positions   %s\n", params.position_encoding == uint32_t(PositionEncoding::Grid)
                                                 ? "integers on the voxel grid, bit-exact"
                                                 : "floats (the checkpoint is on no grid)");
    if (params.flags & kModelCompact)
        text += "compact     features and offsets on steps that a GPU holds in 8 and 10 bits\n";
    text += formatString("bounds      (%g, %g, %g) to (%g, %g, %g)\n", double(params.bounds_min[0]),
                         double(params.bounds_min[1]), double(params.bounds_min[2]), double(params.bounds_max[0]),
                         double(params.bounds_max[1]), double(params.bounds_max[2]));
    for (const LevelRecord& level : view.levels)
        text += formatString(
            "level %-5d %s, %s, %s, %s; quantum %g, cell %u quanta\n", level.level,
            formatCount(level.anchor_count, "anchor").c_str(), formatCount(level.chunk_count, "chunk").c_str(),
            formatCount(level.group_count, "group").c_str(), formatCount(level.leaf_count, "leaf", "leaves").c_str(),
            double(level.quantum), 1u << level.cell_log2);
    text += formatString("chunks      %s, at most %s and %s each\n", formatCount(params.chunk_count).c_str(),
                         formatCount(params.max_chunk_anchors, "anchor").c_str(),
                         formatBytes(params.max_chunk_bytes).c_str());
    for (const Json& mlp : mlpsOf(manifest))
        text += "mlp         " + mlpText(mlp) + "\n";
    if (const SectionEntry* cameras = findSection(view, kSectionCameras))
        text += formatString("cameras     %s\n", formatCount(cameras->count).c_str());
    text += metreText(view, manifest);
    text += formatString("sensitivity %s\n", findSection(view, kSectionSensitivity) != nullptr
                                                 ? "baked, of every anchor"
                                                 : "not baked; a player computes it where it needs it");
    for (const SectionEntry& entry : view.sections)
        text += formatString("%-11s %s\n", fourCcText(entry.type).c_str(), formatBytes(entry.bytes).c_str());
    if (manifest.is_object() && manifest.contains("source"))
        text += "source      " + oneLine(manifest["source"]) + "\n";
    if (manifest.is_object() && manifest.contains("reduction"))
        text += "baked       " + bakedText(manifest["reduction"]) + "\n";
    if (manifest.is_object() && manifest.contains("crop"))
        text += "crop        " + oneLine(manifest["crop"]) + "\n";
    return text;
}

struct InfoOptions {
    std::string file;
    std::optional<std::array<double, 3>> at;
};

ErrorCode runInfo(const InfoOptions& options, Reporter& report)
{
    const std::string& path = options.file;
    const IssueSink sink = throwFirstIssue(path);
    const GscFile file(path, sink, options.at ? GscFile::Read::All : GscFile::Read::Summary);
    GscView view;
    // --at follows indices in the records, so these must be checked first
    if (options.at)
        openGsc(file.bytes(), view, GscCheck::Index, sink);
    else
        openGscSummary(file.bytes(), view, sink);
    // with limits on size and depth, because the manifest may come from anybody
    ParsedRow parsed = parseRow(view.manifest);
    if (parsed.state != ParsedRow::State::Whole)
        throw Error(ErrorCode::InvalidFile, path, "META " + parsed.fault, "the manifest",
                    "gsc validate lists everything wrong with it");
    const Json manifest = std::move(parsed.json);
    if (!report.json()) {
        report.text(options.at ? atText(path, view, *options.at) : infoText(path, file, view, manifest));
        return ErrorCode::Ok;
    }
    Json json = infoJson(path, file, view, manifest);
    if (options.at)
        json["at"] = atJson(path, view, *options.at);
    report.object(json);
    return ErrorCode::Ok;
}

} // namespace

void addInfoCommand(CLI::App& app, Invocation& invocation)
{
    auto options = std::make_shared<InfoOptions>();
    CLI::App& command = addCommand(app, "info", "Tell what a .gsc file holds, from its header and index alone");
    addText(command, "FILE", options->file, "FILE.gsc", "file to look at").required();
    detail::addValue(
        command, "--at", "X,Y,Z",
        "tell what lies at a point, in world units: voxel, leaf, chunk, groups and nearest anchor of each level",
        [options](const std::string& name, const std::string& text) { options->at = parsePoint(name, text); });
    addReporterOptions(command, invocation.reporter, false);
    setFooter(command, "examples:\n"
                       "  gsc info city.gsc\n"
                       "  gsc info city.gsc --at 1.5,-2,0.25\n"
                       "  gsc info --format json city.gsc | jq .levels");
    onParsed(command, invocation, options, runInfo);
}

} // namespace gsc
