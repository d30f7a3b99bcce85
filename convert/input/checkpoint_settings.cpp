// SPDX-License-Identifier: Apache-2.0
// Settings with which a trainer draws another picture than tier `exact` does of the same PLY and weights.
#include "convert/input/checkpoint_model.h"

#include <gsc/error.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <string_view>
#include <utility>

namespace gsc {

namespace {

// A switch that has to be off, a number that has to be this one, or a word that has to be one of these.
struct TrainerSetting {
    enum class Kind : uint8_t { Off, Number, Words };

    const char* key;
    Kind kind;
    const char* effect; // "the trainer <effect>"
    double number = 0;
    const char* words = ""; // with spaces around each
};

constexpr TrainerSetting kSettings[] = {
    {"random_background", TrainerSetting::Kind::Off,
     "draws on a colour that it picks at random, which is stored nowhere"},
    {"antialiasing", TrainerSetting::Kind::Off, "makes small splats fainter"}, // 3DGS since October 2024
    {"antialiased", TrainerSetting::Kind::Off, "makes small splats fainter"},
    {"with_ut", TrainerSetting::Kind::Off, "projects with the unscented transform"}, // gsplat 1.5
    {"with_eval3d", TrainerSetting::Kind::Off, "blends in 3D"},
    {"rasterize_mode", TrainerSetting::Kind::Words, "makes small splats fainter", 0, " classic "}, // gsplat
    {"camera_model", TrainerSetting::Kind::Words, "draws through another lens", 0, " pinhole PINHOLE "},
    {"render_mode", TrainerSetting::Kind::Words, "draws depths and no colours", 0, " RGB RGB+D RGB+ED "},
    {"base_model", TrainerSetting::Kind::Words, "draws other primitives", 0, " scaffoldgs "}, // Octree-AnyGS
    {"gs_attr", TrainerSetting::Kind::Words, "draws flat splats", 0, " 3D 3d "},              // Horizon-GS
    {"color_attr", TrainerSetting::Kind::Words, "draws colours from spherical harmonics", 0, " RGB rgb "},
    {"kernel_size", TrainerSetting::Kind::Number, "widens splats by another amount", 0.3}, // Mip-Splatting
    {"eps2d", TrainerSetting::Kind::Number, "widens splats by another amount", 0.3},       // gsplat
    {"radius_clip", TrainerSetting::Kind::Number, "leaves small splats out", 0},
    {"scaling_modifier", TrainerSetting::Kind::Number, "scales every Gaussian", 1},
    {"scale_modifier", TrainerSetting::Kind::Number, "scales every Gaussian", 1},
    {"view_dim", TrainerSetting::Kind::Number, "gives its MLPs another view", 3}, // Octree-AnyGS
};

[[noreturn]] void refuse(const ConfigFile& config, const std::string& key, const std::string& value, const char* effect,
                         const std::string& expected)
{
    throw Error(ErrorCode::Unsupported, config.path, key + " is " + value + ", so the trainer " + effect, expected,
                "train without it, or correct the file if the model was drawn without it");
}

// `value` in words, as a message has it.
std::string shown(const ConfigValue& value)
{
    if (value.kind == ConfigValue::Kind::Bool)
        return value.integer != 0 ? "True" : "False";
    return value.kind == ConfigValue::Kind::String || value.kind == ConfigValue::Kind::Other
               ? "'" + value.text.substr(0, 64) + "'"
               : formatString("%g", value.number);
}

bool fits(const TrainerSetting& setting, const ConfigValue& group, const std::string& key, const std::string& path)
{
    if (setting.kind == TrainerSetting::Kind::Off)
        return !group.getBool(key, false, path);
    if (setting.kind == TrainerSetting::Kind::Number) // files round numbers
        return std::abs(group.getNumber(key, setting.number, path) - setting.number) < 1e-6;
    const std::string word = group.getString(key, "", path);
    return word.find(' ') == std::string::npos &&
           std::string_view(setting.words).find(" " + word + " ") != std::string_view::npos;
}

void checkSetting(const TrainerSetting& setting, const ConfigFile& config)
{
    const std::string nested = config.modelKey(setting.key);
    for (const auto& [group, key] : {std::pair<const ConfigValue*, std::string>{&config.values, nested},
                                     {&config.values, setting.key},
                                     {&config.pipeline, setting.key}}) {
        if (!group->states(key) || fits(setting, *group, key, config.path))
            continue;
        std::string words = setting.words;
        words = setting.kind == TrainerSetting::Kind::Off      ? "False"
                : setting.kind == TrainerSetting::Kind::Number ? formatString("%g", setting.number)
                                                               : "'" + words.substr(1, words.find(' ', 1) - 1) + "'";
        refuse(config, setting.key, shown(*group->find(key)), setting.effect, words);
    }
}

// Arguments of gsplat's rasterization(); diff-gaussian-rasterization has its near plane in its code and no far one.
void checkPlanes(const Checkpoint& checkpoint, const ConfigFile& config)
{
    const bool gsplat = checkpoint.raster_rules == RasterRules::Gsplat;
    const double near_plane = gsplat ? 0.01 : 0.2, far_plane = 1e10;
    for (const ConfigValue* group : {&config.values, &config.pipeline}) {
        if (const double stated = group->getNumber("near_plane", near_plane, config.path);
            std::abs(stated - near_plane) > 1e-6)
            refuse(config, "near_plane", formatString("%g", stated), "starts to draw at another distance",
                   formatString("%g", near_plane));
        if (const double stated = group->getNumber("far_plane", far_plane, config.path); stated < far_plane)
            refuse(config, "far_plane", formatString("%g", stated), "leaves out what is farther away", "1e10 or more");
    }
}

// The trainer measures distances for the levels in units of these; its own renderings take all of them.
void checkScales(const ConfigFile& config, std::vector<std::string>& warnings)
{
    const ConfigValue* scales = config.values.find("resolution_scales");
    if (!scales || scales->kind != ConfigValue::Kind::List || scales->list.empty())
        return;
    const auto isOne = [](const ConfigValue& scale) { return scale.number == 1; };
    const auto other = std::ranges::find_if_not(scales->list, isOne);
    if (other == scales->list.end())
        return;
    if (std::ranges::none_of(scales->list, isOne))
        refuse(config, "resolution_scales", "[" + shown(*other) + "]", "takes levels as from another distance",
               "[1.0]");
    warnings.push_back(config.path + ": resolution_scales lists " + shown(*other) +
                       " too, with which the trainer takes levels as from another distance; levels are those of scale "
                       "1");
}

// A class of Octree-AnyGS's that has levels draws those that a camera needs, one that has none draws all there are.
void checkClass(const ConfigFile& config, bool has_levels)
{
    const std::string name = config.values.getString("model_config.name", "", config.path);
    const char* const expected = has_levels ? "GaussianLoDModel" : "GaussianModel";
    if (!name.empty() && name != expected)
        refuse(config, "model_config.name", "'" + name.substr(0, 64) + "'",
               has_levels ? "draws the levels of this PLY in another way"
                          : "draws this PLY, which has no levels, not at all",
               std::string("'") + expected + "'");
}

// The trainer reads the bank where this says so, whatever lies beside it.
void checkBank(const Checkpoint& checkpoint, const ConfigFile& config)
{
    const std::string key = config.modelKey("use_feat_bank");
    const bool is_there = checkpoint.mlps.size() > uint32_t(MlpKind::FeatureBank);
    if (config.values.states(key) && config.values.getBool(key, false, config.path) != is_there)
        refuse(config, "use_feat_bank", is_there ? "False" : "True",
               is_there ? "draws without the feature bank whose weights are there"
                        : "draws with a feature bank whose weights are missing",
               is_there ? "True" : "False");
}

} // namespace

void refuseOtherPictures(Checkpoint& checkpoint, const ConfigFile& config, bool has_levels)
{
    if (!config.found())
        return;
    for (const TrainerSetting& setting : kSettings)
        checkSetting(setting, config);
    checkPlanes(checkpoint, config);
    checkScales(config, checkpoint.warnings);
    if (checkpoint.family == ModelFamily::OctreeAnyGs)
        checkClass(config, has_levels);
    checkBank(checkpoint, config);
    // the older renderers then take covariances that their visibility pass cannot make; Octree-AnyGS never looks
    const bool covariances = config.values.getBool("compute_cov3D_python", false, config.path);
    if (covariances && checkpoint.family != ModelFamily::OctreeAnyGs)
        refuse(config, "compute_cov3D_python", "True", "cannot draw this model", "False");
}

} // namespace gsc
