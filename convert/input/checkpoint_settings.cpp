// SPDX-License-Identifier: Apache-2.0
// Refuses settings with which a trainer draws another picture than tier `exact` from one PLY and its weights.
#include "convert/input/checkpoint_model.h"

#include <gsc/error.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <string_view>
#include <utility>

namespace gsc {

namespace {

// One of the trainer's settings and the only value that we can draw: off, a number, or one of some words.
struct TrainerSetting {
    enum class Kind : uint8_t { Off, Number, Words };

    const char* key;
    Kind kind;
    const char* effect; // ends the sentence "the trainer ..." of the message
    double number = 0;
    const char* words = ""; // accepted words, with a space before and after each
};

constexpr TrainerSetting kSettings[] = {
    {"random_background", TrainerSetting::Kind::Off,
     "draws on a colour that it picks at random, which is stored nowhere"},
    {"antialiasing", TrainerSetting::Kind::Off, "makes small splats fainter"}, // setting of 3DGS since October 2024
    {"antialiased", TrainerSetting::Kind::Off, "makes small splats fainter"},
    {"with_ut", TrainerSetting::Kind::Off, "projects with the unscented transform"}, // setting of gsplat 1.5
    {"with_eval3d", TrainerSetting::Kind::Off, "blends in 3D"},
    // setting of gsplat
    {"rasterize_mode", TrainerSetting::Kind::Words, "makes small splats fainter", 0, " classic "},
    {"camera_model", TrainerSetting::Kind::Words, "draws through another lens", 0, " pinhole PINHOLE "},
    {"render_mode", TrainerSetting::Kind::Words, "draws depths and no colours", 0, " RGB RGB+D RGB+ED "},
    // setting of Octree-AnyGS
    {"base_model", TrainerSetting::Kind::Words, "draws other primitives", 0, " scaffoldgs "},
    {"gs_attr", TrainerSetting::Kind::Words, "draws flat splats", 0, " 3D 3d "}, // setting of Horizon-GS
    {"color_attr", TrainerSetting::Kind::Words, "draws colours from spherical harmonics", 0, " RGB rgb "},
    {"kernel_size", TrainerSetting::Kind::Number, "widens splats by another amount", 0.3}, // setting of Mip-Splatting
    {"eps2d", TrainerSetting::Kind::Number, "widens splats by another amount", 0.3},       // setting of gsplat
    {"radius_clip", TrainerSetting::Kind::Number, "leaves small splats out", 0},
    {"scaling_modifier", TrainerSetting::Kind::Number, "scales every Gaussian", 1},
    {"scale_modifier", TrainerSetting::Kind::Number, "scales every Gaussian", 1},
    {"view_dim", TrainerSetting::Kind::Number, "gives its MLPs another view", 3}, // setting of Octree-AnyGS
};

[[noreturn]] void refuse(const ConfigFile& config, const std::string& key, const std::string& value, const char* effect,
                         const std::string& expected)
{
    throw Error(ErrorCode::Unsupported, config.path, key + " is " + value + ", so the trainer " + effect, expected,
                "train without it, or correct the file if the model was drawn without it");
}

// Text of `value` for a message.
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
    if (setting.kind == TrainerSetting::Kind::Number) // with a tolerance, because files round numbers
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

// Refuses near and far planes other than ours. They are arguments of gsplat's rasterization();
// diff-gaussian-rasterization has its near plane in its code and no far plane.
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

// Warns of `resolution_scales` other than 1, and throws if 1 is not among them: the trainer scales distances by them
// when it chooses levels.
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

// Refuses a class of Octree-AnyGS's that does not fit the model: classes with levels draw only the anchors that a
// camera needs, classes without draw all.
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

// Refuses a setting that contradicts whether weights of the feature bank are there: the trainer goes by the setting.
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
    // with this setting the older trainers cannot draw the model, because their visibility pass makes no covariances;
    // Octree-AnyGS ignores it
    const bool covariances = config.values.getBool("compute_cov3D_python", false, config.path);
    if (covariances && checkpoint.family != ModelFamily::OctreeAnyGs)
        refuse(config, "compute_cov3D_python", "True", "cannot draw this model", "False");
}

} // namespace gsc
