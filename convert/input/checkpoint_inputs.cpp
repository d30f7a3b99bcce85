// SPDX-License-Identifier: Apache-2.0
// Finds which values each MLP takes as input. The widths of the weight matrices decide, and cfg_args only where they
// leave it open, because the trainers' cfg_args can be wrong.
#include "convert/input/checkpoint_model.h"

#include "convert/input/model_names.h"
#include <gsc/error.h>

#include <cmath>

namespace gsc {

namespace {

constexpr uint32_t kDirection = 3; // components of the view direction

const char* mlpName(MlpKind kind)
{
    return kMlpNames[uint32_t(kind)];
}

// Path of the file that holds MLP `i`: one file per MLP in a "split" checkpoint, else one file for all.
const std::string& fileOf(const Checkpoint& checkpoint, size_t i)
{
    return checkpoint.weight_paths[checkpoint.container == "split" ? i : 0];
}

void checkShape(const Mlp& mlp, uint32_t hidden, uint32_t out, const std::string& path)
{
    if (mlp.layers[0].out != hidden || mlp.layers[1].out != out)
        throw Error(ErrorCode::InvalidFile, path,
                    formatString("%s has %u hidden values and %u results", mlpName(mlp.kind), mlp.layers[0].out,
                                 mlp.layers[1].out),
                    formatString("%u and %u for the columns of the PLY", hidden, out),
                    "PLY and weights belong to different models");
}

// Number of inputs of an MLP besides feature, direction and appearance. Throws if it is more than `most`.
uint32_t extraInputs(const Mlp& mlp, uint32_t feat_dim, uint32_t appearance, uint32_t most, const std::string& path)
{
    const uint32_t base = feat_dim + kDirection + (mlp.kind == MlpKind::Color ? appearance : 0);
    const uint32_t width = mlp.layers[0].in;
    if (width >= base && width - base <= most)
        return width - base;
    if (mlp.kind == MlpKind::Color && appearance == 0 && width > base)
        throw Error(
            ErrorCode::InvalidFile, path, formatString("color_mlp takes %u values", width), formatString("%u", base),
            formatString("the other %u are an appearance embedding that is missing, copy embedding_appearance.pt too",
                         width - base));
    throw Error(ErrorCode::Unsupported, path, formatString("%s takes %u values", mlpName(mlp.kind), width),
                formatString("%u to %u (feature %u, direction 3, distance, level%s)", base, base + most, feat_dim,
                             mlp.kind == MlpKind::Color ? ", appearance" : ""),
                "only the MLPs of Scaffold-GS and Octree-GS can be converted");
}

// Width of the appearance embedding that the colour MLP takes: 0 if its first layer has no room for the saved
// embedding. `most`: largest number of other extra inputs.
uint32_t usedAppearance(const Checkpoint& checkpoint, uint32_t most)
{
    const uint32_t columns = checkpoint.appearance_dim;
    const uint32_t base = checkpoint.feat_dim + kDirection, width = checkpoint.mlps[2].layers[0].in;
    const bool with = width >= base + columns && width - base - columns <= most;
    const bool without = width >= base && width - base <= most;
    return columns != 0 && !with && without ? 0 : columns;
}

// For Octree-GS: 1 if the MLPs take the level as an input, 0 if not, -1 if the widths of the layers do not tell.
int levelFromWidths(const uint32_t (&extra)[3], const Mlp* bank)
{
    if (bank)
        return bank->layers[0].in == kDirection + 1;
    for (const uint32_t count : extra)
        if (count == 0 || count == 2)
            return count == 2;
    return -1;
}

int resolveLevel(const uint32_t (&extra)[3], const Mlp* bank, const ConfigFile& config,
                 const CheckpointOptions& options, const std::string& path)
{
    const int from_widths = levelFromWidths(extra, bank);
    if (from_widths >= 0) {
        if (options.add_level >= 0 && options.add_level != from_widths)
            throw Error(ErrorCode::Usage, path,
                        formatString("the widths of the MLPs show that they %s the level",
                                     from_widths ? "take" : "do not take"),
                        formatString("what --add-level %d says", options.add_level), "leave the option out");
        return from_widths;
    }
    const std::string key = config.modelKey("add_level");
    if (config.values.states(key)) {
        const bool stated = config.values.getBool(key, false, config.path);
        if (options.add_level >= 0 && options.add_level != int(stated))
            throw Error(ErrorCode::Usage, config.path, formatString("add_level is %s", stated ? "True" : "False"),
                        formatString("what --add-level %d says", options.add_level), "leave the option out");
        return stated;
    }
    if (options.add_level >= 0)
        return options.add_level;
    throw Error(ErrorCode::InvalidFile, path,
                "every MLP takes one value besides feature and direction, which is the distance or the level, and no "
                "cfg_args says which",
                "one that does",
                "pass --add-level 0 (distance) or --add-level 1 (level), or the folder of cfg_args with --scene-dir");
}

void assignBank(Checkpoint& checkpoint, Mlp& bank, int add_level, const std::string& path)
{
    checkShape(bank, checkpoint.feat_dim, 3, path);
    const bool octree = checkpoint.family == ModelFamily::OctreeGs;
    const bool scaffold =
        checkpoint.family == ModelFamily::ScaffoldGs || checkpoint.family == ModelFamily::ScaffoldGsV1;
    const uint32_t extra = bank.layers[0].in - kDirection;
    const uint32_t expected = scaffold ? 1 : octree ? uint32_t(add_level) : 0;
    if (bank.layers[0].in < kDirection || extra != expected)
        throw Error(ErrorCode::Unsupported, path, formatString("feature_bank_mlp takes %u values", bank.layers[0].in),
                    formatString("%u", kDirection + expected),
                    "only the MLPs of Scaffold-GS and Octree-GS can be converted");
    if (checkpoint.feat_dim % 4 != 0)
        throw Error(ErrorCode::InvalidFile, path, formatString("a feature bank with %u features", checkpoint.feat_dim),
                    "a multiple of 4", "PLY and weights belong to different models");
    checkpoint.flags |= kModelFeatureBank;
    if (extra == 1) {
        checkpoint.flags |= scaffold ? kModelBankDistance : kModelBankLevel;
        bank.inputs = scaffold ? kMlpTakesDistance : kMlpTakesLevel;
    }
}

// Warns where cfg_args and the weights disagree: the weights are used, but one of the two seems to belong to another
// model.
void compareConfig(const Checkpoint& checkpoint, const ConfigFile& config, std::vector<std::string>& warnings)
{
    const std::pair<const char*, uint32_t> sizes[] = {{"feat_dim", checkpoint.feat_dim},
                                                      {"n_offsets", checkpoint.n_offsets},
                                                      {"appearance_dim", checkpoint.appearance_dim}};
    for (const auto& [name, size] : sizes) {
        const std::string key = config.modelKey(name);
        if (const double stated = config.values.getNumber(key, size, config.path); stated != size)
            warnings.push_back(config.path +
                               formatString(": %s is %g, but the model has %u; the model is followed, and "
                                            "the file may be another model's",
                                            name, stated, size));
    }
    constexpr const char* keys[3] = {"add_opacity_dist", "add_cov_dist", "add_color_dist"};
    for (size_t i = 0; config.found() && i < 3; ++i) {
        const std::string key = config.modelKey(keys[i]);
        const bool taken = checkpoint.mlps[i].inputs & kMlpTakesDistance;
        if (config.values.find(key) && config.values.getBool(key, false, config.path) != taken)
            warnings.push_back(config.path + ": " + keys[i] + " is " + (taken ? "False" : "True") + ", but " +
                               mlpName(checkpoint.mlps[i].kind) + (taken ? " takes" : " does not take") +
                               " the distance; the weights are followed");
    }
}

} // namespace

void assignInputs(Checkpoint& checkpoint, const ConfigFile& config, const CheckpointOptions& options)
{
    const uint32_t feat_dim = checkpoint.feat_dim, n_offsets = checkpoint.n_offsets;
    const bool octree = checkpoint.family == ModelFamily::OctreeGs;
    const uint32_t most = octree ? 2 : checkpoint.family == ModelFamily::OctreeAnyGs ? 0 : 1;
    const uint32_t results[3] = {n_offsets, 7 * n_offsets, 3 * n_offsets};
    const uint32_t appearance = usedAppearance(checkpoint, most);
    if (appearance == 0 && checkpoint.appearance_dim != 0) {
        // file of the embedding if it has one of its own, else that of all weights
        checkpoint.warnings.push_back(checkpoint.weight_paths.back() +
                                      ": an appearance embedding is saved, but color_mlp does not take it; it is "
                                      "left out");
        checkpoint.appearance_dim = 0;
        checkpoint.embedding.clear();
    }
    std::vector<Mlp>& mlps = checkpoint.mlps;
    uint32_t extra[3];
    for (size_t i = 0; i < 3; ++i) {
        checkShape(mlps[i], feat_dim, results[i], fileOf(checkpoint, i));
        extra[i] = extraInputs(mlps[i], feat_dim, appearance, most, fileOf(checkpoint, i));
    }
    Mlp* bank = mlps.size() > 3 ? &mlps[3] : nullptr;
    const int add_level = octree ? resolveLevel(extra, bank, config, options, fileOf(checkpoint, 0)) : 0;
    for (size_t i = 0; i < 3; ++i) {
        if (extra[i] < uint32_t(add_level))
            throw Error(ErrorCode::InvalidFile, fileOf(checkpoint, i),
                        formatString("%s has no room for the level that the other MLPs take", mlpName(mlps[i].kind)),
                        "all or none", "the files belong to different models");
        const uint32_t others = extra[i] - uint32_t(add_level);
        if (others > 1)
            throw Error(ErrorCode::InvalidFile, fileOf(checkpoint, i),
                        formatString("%s takes two values besides feature and direction", mlpName(mlps[i].kind)), "one",
                        "the files belong to different models");
        uint32_t& inputs = mlps[i].inputs;
        inputs = kMlpTakesFeature;
        if (others == 1)
            inputs |= kMlpTakesDistance;
        if (add_level)
            inputs |= kMlpTakesLevel;
        if (i == 2 && appearance != 0)
            inputs |= kMlpTakesAppearance;
    }
    if (bank)
        assignBank(checkpoint, *bank, add_level, fileOf(checkpoint, 3));
    compareConfig(checkpoint, config, checkpoint.warnings);
}

} // namespace gsc
