// SPDX-License-Identifier: Apache-2.0
#include "convert/write/model_sections.h"

#include "format/numbers/count_text.h"
#include "convert/input/model_names.h"
#include <gsc/error.h>
#include <gsc/half.h>
#include "kernels/sensitivity/sensitivity.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cstring>
#include <numeric>
#include <string_view>

namespace gsc {

namespace {

using Json = nlohmann::ordered_json;

const char* const kMlpKinds[] = {"opacity", "covariance", "color", "feature_bank"};
const char* const kActivations[] = {"none", "tanh", "sigmoid", "softmax"};

const char* sensitivityName(SensitivityMode mode)
{
    return mode == SensitivityMode::None ? "none" : "sampled";
}

std::string fileName(const std::string& path)
{
    return path.substr(path.find_last_of('/') + 1);
}

std::string hex(uint64_t value)
{
    return formatString("%016llx", (unsigned long long)value);
}

Json optionsJson(const WriteOptions& options)
{
    return {{"appearance", options.appearance < 0 ? Json("all") : Json(options.appearance)},
            {"chunk_anchors", options.chunk_anchors},
            {"drop_invalid", options.drop_invalid},
            {"sensitivity", sensitivityName(options.sensitivity)}};
}

// Manifest entry of section SENS; null if the file has none.
Json sensitivityJson(const ManifestFacts& facts)
{
    if (facts.sensitivity.empty())
        return nullptr;
    uint16_t direction = 0, distance = 0;
    for (const AnchorSensitivity& s : facts.sensitivity) {
        direction = std::max(direction, s.direction);
        distance = std::max(distance, s.distance);
    }
    return {{"method", sensitivityName(facts.options->sensitivity)},
            {"directions", kProbes},
            {"appearance", facts.embedding_rows.empty() ? Json(nullptr) : Json(facts.embedding_rows[0])},
            {"direction_max", halfToFloat(direction)},
            {"distance_max", halfToFloat(distance)}};
}

Json mlpJson(const Mlp& mlp)
{
    Json inputs = Json::array();
    if (mlp.inputs & kMlpTakesFeature)
        inputs.push_back("feature");
    inputs.push_back("direction");
    if (mlp.inputs & kMlpTakesDistance)
        inputs.push_back("distance");
    if (mlp.inputs & kMlpTakesLevel)
        inputs.push_back("level");
    if (mlp.inputs & kMlpTakesAppearance)
        inputs.push_back("appearance");
    return {{"kind", kMlpKinds[uint32_t(mlp.kind)]},
            {"inputs", inputs},
            {"in", mlp.layers[0].in},
            {"hidden", mlp.layers[0].out},
            {"out", mlp.layers[1].out},
            {"activation", kActivations[uint32_t(mlp.activation)]}};
}

Json modelJson(const ManifestFacts& facts)
{
    const ModelParams& p = *facts.params;
    Json mlps = Json::array();
    for (const Mlp& mlp : facts.checkpoint->mlps)
        mlps.push_back(mlpJson(mlp));
    return {{"anchors", facts.source_rows - facts.dropped},
            {"feat_dim", p.feat_dim},
            {"n_offsets", p.n_offsets},
            {"appearance_dim", p.appearance_dim},
            {"appearance_rows", facts.embedding_rows.size()},
            {"has_levels", bool(p.flags & kModelHasLevels)},
            {"level_rule", kLevelRuleNames[p.level_rule]},
            {"levels", p.level_count},
            {"level_min", p.level_min},
            {"level_clamp", p.level_clamp},
            {"fork", p.fork},
            {"standard_dist", p.standard_dist},
            {"voxel_size", p.voxel_size},
            {"grid_origin", p.grid_origin},
            {"feature_bank", bool(p.flags & kModelFeatureBank)},
            {"white_background", bool(p.flags & kModelWhiteBackground)},
            {"raster_rules", kRasterRulesNames[p.raster_rules]},
            {"near_z", p.near_z},
            {"cameras", facts.checkpoint->cameras.size()},
            {"metre",
             facts.metre.units > 0 ? Json{{"units", facts.metre.units}, {"rule", facts.metre.rule}} : Json(nullptr)},
            {"mlps", mlps}};
}

Json encodingJson(const ModelParams& p)
{
    const auto optional = [&](uint32_t flag) { return p.flags & flag ? "float32" : "constant"; };
    return {{"position", p.position_encoding == uint32_t(PositionEncoding::Grid) ? "grid16" : "float32"},
            {"extra_level", p.flags & kModelHasLevels ? "float32" : "absent"},
            {"scale", "float32"},
            {"offset", "float32"},
            {"feature", "float32"},
            {"rotation", optional(kModelHasRotation)},
            {"opacity", optional(kModelHasOpacity)},
            {"normal", p.flags & kModelHasNormal ? "float32" : "zero"},
            {"order", "level, leaf morton, cell morton, source index"},
            {"index", "nanovdb 32 mask grid per level"},
            {"mlp", "float32 canonical, float32 and float16 packed"}};
}

// Adds the facts of a file that was made from other files: those of its source, and that its values are rounded if a
// bake made it.
void tellFacts(const Json& facts, Json& manifest)
{
    for (const auto& [name, fact] : facts.items())
        manifest[name] = fact;
    if (!facts.contains("reduction") && !facts.contains("reductions"))
        return;
    for (const char* name : {"scale", "offset", "feature"})
        manifest["encoding"][name] = "float32, multiples of a power of two of each anchor";
    manifest["loss"] = {{"max_abs", {{"position", 0}}},
                        {"verified", "by rendering: see reduction; every position was reproduced bit for bit"}};
}

} // namespace

std::vector<uint32_t> keptEmbeddingRows(const Checkpoint& checkpoint, int appearance)
{
    const uint32_t rows = checkpoint.embeddingRows();
    if (appearance >= 0 && rows == 0)
        throw Error(ErrorCode::Usage, formatString("--appearance %d", appearance),
                    checkpoint.model_path + " has no appearance embedding", "a model trained with one",
                    "leave the option out");
    std::vector<uint32_t> all = checkpoint.embedding_numbers;
    if (all.empty()) {
        all.resize(rows);
        std::iota(all.begin(), all.end(), 0u);
    }
    if (appearance < 0)
        return all;
    if (!std::ranges::binary_search(all, uint32_t(appearance)))
        throw Error(ErrorCode::Usage, formatString("--appearance %d", appearance),
                    "the embedding has " + formatCount(rows, "row"), formatString("%u to %u", all.front(), all.back()),
                    "pass one of these or leave it out");
    return {uint32_t(appearance)};
}

const float* embeddingRow(const Checkpoint& checkpoint, uint32_t number)
{
    const std::vector<uint32_t>& numbers = checkpoint.embedding_numbers;
    const size_t place = numbers.empty() ? number : size_t(std::ranges::lower_bound(numbers, number) - numbers.begin());
    return checkpoint.embedding.data() + place * checkpoint.appearance_dim;
}

std::vector<std::byte> embeddingSection(const Checkpoint& checkpoint, const std::vector<uint32_t>& rows)
{
    const size_t row_bytes = checkpoint.appearance_dim * sizeof(float);
    const size_t start = alignUp(rows.size() * sizeof(uint32_t), kArrayAlign);
    std::vector<std::byte> bytes(start + rows.size() * row_bytes);
    for (size_t i = 0; i < rows.size(); ++i) {
        std::memcpy(bytes.data() + i * sizeof(uint32_t), &rows[i], sizeof(uint32_t));
        std::memcpy(bytes.data() + start + i * row_bytes, embeddingRow(checkpoint, rows[i]), row_bytes);
    }
    return bytes;
}

std::vector<std::byte> cameraSection(const Checkpoint& checkpoint)
{
    std::vector<std::byte> bytes(checkpoint.cameras.size() * sizeof(CameraRecord));
    std::string names;
    for (size_t i = 0; i < checkpoint.cameras.size(); ++i) {
        const SourceCamera& camera = checkpoint.cameras[i];
        CameraRecord record{};
        std::memcpy(record.position, camera.position, sizeof(record.position));
        std::memcpy(record.rotation, camera.rotation, sizeof(record.rotation));
        record.fx = camera.fx;
        record.fy = camera.fy;
        record.width = camera.width;
        record.height = camera.height;
        record.id = camera.id;
        record.appearance = camera.appearance;
        record.name_offset = uint32_t(names.size());
        record.name_bytes = uint32_t(camera.name.size());
        record.is_test = camera.is_test ? 1 : 0;
        names += camera.name;
        std::memcpy(bytes.data() + i * sizeof(CameraRecord), &record, sizeof(record));
    }
    const auto* text = reinterpret_cast<const std::byte*>(names.data());
    bytes.insert(bytes.end(), text, text + names.size());
    return bytes;
}

ModelParams modelParams(const Checkpoint& checkpoint)
{
    ModelParams p{};
    p.family = uint32_t(checkpoint.family);
    p.flags = checkpoint.flags;
    p.feat_dim = checkpoint.feat_dim;
    p.n_offsets = checkpoint.n_offsets;
    p.appearance_dim = checkpoint.appearance_dim;
    p.appearance_rows = checkpoint.embeddingRows();
    p.level_rule = uint32_t(checkpoint.level_rule);
    p.fork = checkpoint.fork;
    p.level_min = checkpoint.level_min;
    p.level_clamp = checkpoint.level_clamp;
    p.standard_dist = checkpoint.standard_dist;
    // the level rule uses the trainer's voxel size, even where positions are stored as floats
    p.voxel_size = checkpoint.flags & kModelHasLevels ? checkpoint.voxel_size : 0;
    p.raster_rules = uint32_t(checkpoint.raster_rules);
    p.near_z = checkpoint.raster_rules == RasterRules::Gsplat ? 0.01f : 0.2f;
    p.mlp_count = uint32_t(checkpoint.mlps.size());
    p.chunk_payload_version = 1;
    p.lod_scale = 1;
    return p;
}

std::string effectiveOptions(const WriteOptions& options)
{
    return optionsJson(options).dump();
}

std::string manifestText(const ManifestFacts& facts)
{
    const Checkpoint& checkpoint = *facts.checkpoint;
    Json weights = Json::array();
    for (const std::string& path : checkpoint.weight_paths)
        weights.push_back(fileName(path));
    Json manifest = {
        {"format", "gsc-manifest"},
        {"version", 1},
        {"generator", {{"name", "gsc"}, {"version", GSC_VERSION}}},
        {"source",
         {{"family", kFamilyNames[uint32_t(checkpoint.family)]},
          {"container", checkpoint.container},
          {"iteration", checkpoint.iteration < 0 ? Json(nullptr) : Json(checkpoint.iteration)},
          {"ply", fileName(checkpoint.ply_path)},
          {"weights", weights},
          {"anchors", facts.source_rows},
          {"dropped", facts.dropped},
          {"hash", hex(facts.source_hash)}}},
        {"model", modelJson(facts)},
        {"encoding", encodingJson(*facts.params)},
        {"sensitivity", sensitivityJson(facts)},
        {"options", optionsJson(*facts.options)},
        {"options_hash", hex(facts.config_hash)},
        {"loss",
         {{"max_abs", {{"position", 0}, {"scale", 0}, {"offset", 0}, {"feature", 0}, {"mlp", 0}}},
          {"verified", "every position was reproduced bit for bit while baking; the other values are copied"}}}};
    if (facts.options->source)
        tellFacts(Json::parse(facts.options->source->facts), manifest);
    // text that came from file names may not be UTF-8: bad bytes are replaced
    return manifest.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

} // namespace gsc
