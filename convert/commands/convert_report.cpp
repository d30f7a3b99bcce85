// SPDX-License-Identifier: Apache-2.0
#include "convert/commands/convert_report.h"

#include "convert/commands/model_facts.h"
#include "convert/write/model_sections.h"
#include "kernels/sensitivity/sensitivity.h"
#include "runtime/cli/version.h"

namespace gsc {

namespace {

// Returns true if the file has every anchor and every row of the appearance embedding of the checkpoint.
bool isLossless(const ConvertFacts& facts)
{
    const bool rows_left_out = facts.options.appearance >= 0 && facts.checkpoint.embeddingRows() > 1;
    return facts.written->dropped == 0 && !rows_left_out;
}

std::string howVerified(const ConvertFacts& facts)
{
    if (facts.verified)
        return "read back: every attribute of every anchor compared bit for bit with the checkpoint";
    return facts.written->exact_grid ? "while baking: every position recomputed from its integers bit for bit; other "
                                       "values are copied as fp32"
                                     : "by construction: every value is copied as fp32, positions too";
}

Json inputJson(const ConvertFacts& facts)
{
    const Checkpoint& checkpoint = facts.checkpoint;
    Json json = {{"path", checkpoint.model_path},
                 {"ply", checkpoint.ply_path},
                 {"weights", checkpoint.weight_paths},
                 {"container", checkpoint.container},
                 {"iteration", checkpoint.iteration >= 0 ? Json(checkpoint.iteration) : Json(nullptr)},
                 {"cameras", checkpoint.cameras.size()}};
    json["bytes"] = facts.written ? Json(facts.written->input_bytes) : Json(nullptr);
    return json;
}

// Model parameters of a checkpoint, with its voxel size even if the model has no levels.
ModelParams paramsOf(const Checkpoint& checkpoint)
{
    ModelParams params = modelParams(checkpoint);
    params.voxel_size = checkpoint.voxel_size;
    return params;
}

double ratio(const WriteReport& written)
{
    return written.input_bytes ? double(written.output_bytes) / double(written.input_bytes) : 0;
}

} // namespace

Json convertJson(const ConvertFacts& facts)
{
    Json json = {
        {"schema", "gsc.convert/1"},
        {"generator", {{"name", "gsc"}, {"version", toolVersion()}}},
        {"dry_run", facts.written == nullptr},
        {"input", inputJson(facts)},
        {"model", modelJson(paramsOf(facts.checkpoint), facts.checkpoint.anchor_count)},
        {"options", Json::parse(effectiveOptions(facts.options))},
    };
    Json stages = Json::array();
    if (const WriteReport* written = facts.written) {
        json["output"] = {{"path", facts.options.output}, {"bytes", written->output_bytes},
                          {"ratio", ratio(*written)},     {"anchors", written->anchors},
                          {"dropped", written->dropped},  {"levels", written->levels},
                          {"chunks", written->chunks},    {"groups", written->groups},
                          {"leaves", written->leaves},    {"positions", written->exact_grid ? "grid" : "float"}};
        json["output"]["sensitivity_thread_seconds"] = facts.options.sensitivity == SensitivityMode::None
                                                           ? Json(nullptr)
                                                           : jsonNumber(written->sensitivity_seconds);
        json["quality"] = {{"lossless", isLossless(facts)},
                           {"verified", facts.verified ? "read-back" : "bake"},
                           {"how", howVerified(facts)}};
        for (const WriteStage& stage : written->stages)
            stages.push_back({{"name", stage.name}, {"seconds", jsonNumber(stage.seconds)}});
    } else {
        json["output"] = nullptr;
        json["quality"] = nullptr;
    }
    json["stages"] = std::move(stages);
    json["seconds"] = jsonNumber(facts.seconds);
    json["peak_memory_bytes"] = peakMemoryBytes();
    json["warnings"] = facts.warnings;
    return json;
}

std::string convertText(const ConvertFacts& facts)
{
    const Checkpoint& checkpoint = facts.checkpoint;
    std::string text = modelText(paramsOf(checkpoint), checkpoint.anchor_count);
    text += formatString("\nread        %s and %s, %s", checkpoint.ply_path.c_str(),
                         formatCount(checkpoint.weight_paths.size(), "weight file").c_str(),
                         formatCount(checkpoint.cameras.size(), "camera").c_str());
    if (!facts.written)
        return text + formatString("\ndry run     nothing written; it would be %s\n", facts.options.output.c_str());
    const WriteReport& written = *facts.written;
    text += formatString("\nwrote       %s, %s (%.3f of the checkpoint)", facts.options.output.c_str(),
                         formatBytes(written.output_bytes).c_str(), ratio(written));
    text += formatString("\nindex       %s, %s, %s, %s", formatCount(written.levels, "level").c_str(),
                         formatCount(written.chunks, "chunk").c_str(), formatCount(written.groups, "group").c_str(),
                         formatCount(written.leaves, "leaf", "leaves").c_str());
    if (facts.options.sensitivity != SensitivityMode::None)
        text += formatString("\nsensitivity sampled from %u directions, %.2f s of all threads together", kProbes,
                             written.sensitivity_seconds);
    if (written.dropped)
        text += formatString("\ndropped     %s with values that are not finite",
                             formatCount(written.dropped, "anchor").c_str());
    text += formatString("\nlossless    %s (%s)\n", isLossless(facts) ? "yes" : "no", howVerified(facts).c_str());
    return text;
}

} // namespace gsc
