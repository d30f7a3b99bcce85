// SPDX-License-Identifier: Apache-2.0
#include "player/sweep/sweep_config.h"

#include <gsc/error.h>
#include "runtime/cameras/json_fields.h"
#include "runtime/records/reuse_names.h"

#include <algorithm>
#include <cmath>
#include <functional>

namespace gsc {

namespace {

constexpr double kMaxCount = 1e15; // most anchors, and most bytes
constexpr uint32_t kMaxFrames = 1000000;
constexpr size_t kMaxRuns = 100000; // most combinations of the axes, per trajectory, equal ones counted too

// Value of a setting, from a listed run or from an axis; `where` names the key, with the index in the list of an axis.
class Value {
public:
    Value(const JsonObject& object, std::string where, const ParsedJson& value)
        : m_object(object), m_where(std::move(where)), m_value(value)
    {
    }

    [[noreturn]] void fail(const std::string& expected) const
    {
        m_object.fail(m_where.c_str(), shownJson(m_value), expected);
    }
    [[nodiscard]] bool isText(const char* text) const { return m_value == text; }

    [[nodiscard]] double number(double smallest, double largest, const char* unit) const
    {
        const double value = m_value.is_number() ? m_value.get<double>() : NAN;
        if (!(value >= smallest && value <= largest))
            fail(formatString("a number from %g to %g, %s", smallest, largest, unit));
        return value;
    }
    [[nodiscard]] uint64_t count(double smallest, double largest, const char* also) const
    {
        const double value = m_value.is_number() ? m_value.get<double>() : NAN;
        if (!(value >= smallest && value <= largest && value == std::floor(value)))
            fail(formatString("an integer from %.0f to %.0f%s", smallest, largest, also));
        return uint64_t(value);
    }
    // A count, 0 for null.
    [[nodiscard]] uint64_t countOrNull(const char* also) const
    {
        return m_value.is_null() ? 0 : count(1, kMaxCount, also);
    }
    template <typename Word>
    [[nodiscard]] Word word(const std::vector<std::pair<std::string, Word>>& words) const
    {
        std::string known;
        for (const auto& [name, word] : words) {
            if (m_value.is_string() && m_value.get_ref<const std::string&>() == name)
                return word;
            known += (known.empty() ? "" : ", ") + ("\"" + name + "\"");
        }
        fail("one of " + known);
    }

private:
    const JsonObject& m_object;
    std::string m_where;
    const ParsedJson& m_value;
};

// A key of a sweep's file, and the function that sets its value in a run.
struct RunSetting {
    const char* key;
    std::function<void(RunConfig& run, const Value& value)> take;
};
using Settings = std::vector<RunSetting>;

Settings settingsFor(const std::vector<std::string>& backends)
{
    std::vector<std::pair<std::string, std::string>> names;
    for (const std::string& name : backends)
        names.emplace_back(name, name);
    return {
        {"policy", [](RunConfig& run, const Value& v) { run.reuse.policy = v.word(reusePolicies()); }},
        {"max_depth",
         [](RunConfig& run, const Value& v) { run.reuse.max_depth = uint32_t(v.count(0, kMaxReuseDepth, " frames")); }},
        {"guidance", [](RunConfig& run, const Value& v) { run.reuse.guidance = v.word(depthGuidances()); }},
        {"bound",
         [](RunConfig& run, const Value& v) { run.reuse.bound = float(v.number(0, kMaxReuseBound, "in 1/255")); }},
        {"decode_budget",
         [](RunConfig& run, const Value& v) {
             run.match_budget = v.isText("match");
             run.reuse.decode_budget =
                 run.match_budget ? 0 : v.countOrNull(" anchors, null for no limit, or \"match\"");
         }},
        {"cache_budget",
         [](RunConfig& run, const Value& v) {
             run.reuse.cache_bytes = v.countOrNull(" bytes, or null for a quarter of the machine's");
         }},
        {"tier", [](RunConfig& run, const Value& v) { static_cast<TierChoice&>(run) = v.word(tierChoices()); }},
        {"detail", // after the tier, because it replaces the detail of tier turbo
         [](RunConfig& run, const Value& v) {
             run.detail = v.number(0, double(kMostDetail), "pixels; 0 = everything is drawn by itself");
         }},
        {"lod_bias",
         [](RunConfig& run, const Value& v) { run.lod_bias = v.number(-kMaxLodBias, kMaxLodBias, "levels"); }},
        {"lod_fade", [](RunConfig& run, const Value& v) { run.lod_fade = v.number(0, kMaxLodWidth, "levels"); }},
        {"lod_hysteresis",
         [](RunConfig& run, const Value& v) { run.lod_hysteresis = v.number(0, kMaxLodWidth, "levels"); }},
        {"fovea_pixels",
         [](RunConfig& run, const Value& v) {
             const double pixels = v.number(0, kMostFoveaPixels, "pixels; 0 = without foveation");
             run.foveation = pixels > 0 ? FoveationMode::Fixed : FoveationMode::None;
             run.fovea_pixels = pixels;
         }},
        {"stereo", [](RunConfig& run, const Value& v) { run.stereo = v.word(stereoModes()); }},
        {"backend", [names](RunConfig& run, const Value& v) { run.backend = v.word(names); }},
    };
}

void checkKeys(const JsonObject& object, const Settings& settings)
{
    std::vector<const char*> keys;
    for (const RunSetting& setting : settings)
        keys.push_back(setting.key);
    object.checkKeys(keys);
}

// Every combination of the values of the axes. Throws Error(InvalidFile) if they are more than kMaxRuns.
std::vector<RunConfig> productOf(const JsonObject& axes, Settings settings, const RunConfig& base)
{
    checkKeys(axes, settings);
    // settings of reuse vary fastest
    std::rotate(settings.begin(), std::ranges::find(settings, std::string_view("tier"), &RunSetting::key),
                settings.end());
    std::vector<RunConfig> product = {base};
    for (const RunSetting& setting : settings) {
        const ParsedJson* list = axes.find(setting.key);
        if (!list)
            continue;
        if (!list->is_array() || list->empty())
            axes.fail(setting.key, shownJson(*list), "an array of at least one value");
        if (list->size() > kMaxRuns / product.size())
            throw Error(ErrorCode::InvalidFile, "sweep",
                        formatString("its axes have more than %zu combinations", kMaxRuns), "fewer",
                        "shorten an axis or list runs");
        std::vector<RunConfig> wider;
        for (const RunConfig& run : product)
            for (size_t i = 0; i < list->size(); ++i)
                setting.take(wider.emplace_back(run), Value(axes, formatString("%s[%zu]", setting.key, i), (*list)[i]));
        product = std::move(wider);
    }
    return product;
}

RunConfig readRun(const JsonObject& object, const Settings& settings, const RunConfig& base)
{
    checkKeys(object, settings);
    RunConfig run = base;
    for (const RunSetting& setting : settings)
        if (const ParsedJson* value = object.find(setting.key))
            setting.take(run, Value(object, setting.key, *value));
    if (run.stereo == StereoMode::Merged && run.reuse.policy == ReusePolicy::Error)
        object.fail("stereo", "\"merged\" with a policy that bounds the change for each eye",
                    "\"exact\", or the policy \"depth\" or \"none\"");
    if (const ParsedJson* pixels = object.find("detail"); pixels && run.detail > 0 && run.tier == Tier::Exact)
        object.fail("detail", shownJson(*pixels) + " with tier exact, which draws everything by itself",
                    "0, or the tier \"fast\" or \"turbo\"");
    if (run.tier != Tier::Exact && run.detail > 0 && run.reuse.policy != ReusePolicy::None)
        object.fail(object.find("policy") ? "policy" : "detail",
                    formatString("\"%s\" with a detail of %g pixels: both keep what was decoded",
                                 policyName(run.reuse.policy), run.detail),
                    "the policy \"none\", or the detail 0");
    if (const ParsedJson* pixels = object.find("fovea_pixels");
        pixels && run.foveaPixels() > 0 && run.tier == Tier::Exact)
        object.fail("fovea_pixels", shownJson(*pixels) + " with tier exact, which leaves nothing out",
                    "0, or the tier \"fast\"");
    return run;
}

void readTrajectories(const JsonObject& root, SweepConfig& config)
{
    const ParsedJson& list = root.at("trajectories");
    if (!list.is_array() || list.empty())
        root.fail("trajectories", shownJson(list), "an array of at least one camera file or \"stored\"");
    for (size_t i = 0; i < list.size(); ++i) {
        if (!list[i].is_string() || list[i].get<std::string>().empty())
            root.fail(formatString("trajectories[%zu]", i).c_str(), shownJson(list[i]),
                      "the path of a camera file or \"stored\"");
        config.trajectories.push_back(list[i].get<std::string>());
    }
}

// Reads the keys of the frames; null counts as a key that is not there.
void readFrames(const JsonObject& root, SweepConfig& config)
{
    const auto given = [&](const char* key) {
        const ParsedJson* value = root.find(key);
        return value && !value->is_null() ? value : nullptr;
    };
    if (const ParsedJson* size = given("size")) {
        if (!size->is_array() || size->size() != 2)
            root.fail("size", shownJson(*size), "[width, height] or null");
        config.width = uint32_t(Value(root, "size[0]", (*size)[0]).count(1, kMaxImageSide, " pixels"));
        config.height = uint32_t(Value(root, "size[1]", (*size)[1]).count(1, kMaxImageSide, " pixels"));
    }
    if (const ParsedJson* fov = given("fov_degrees"))
        config.fov_degrees = Value(root, "fov_degrees", *fov).number(0.01, 179.9, "or null");
    if (const ParsedJson* eyes = given("eyes"))
        config.eyes = int(Value(root, "eyes", *eyes).count(1, 2, ""));
    if (const ParsedJson* frames = given("frames"))
        config.frames = Value(root, "frames", *frames).count(1, kMaxFrames, " or null for all");
    if (const ParsedJson* warmup = given("warmup"))
        config.warmup = uint32_t(Value(root, "warmup", *warmup).count(0, kMaxFrames, " frames"));
    if (const ParsedJson* every = given("score_every"))
        config.score.every = Value(root, "score_every", *every).count(1, kMaxFrames, " frames, 1 = every one");
    if (const ParsedJson* first = given("score_first"))
        config.score.first = Value(root, "score_first", *first).count(0, kMaxFrames, ", a frame from 0");
    if (const ParsedJson* quality = given("quality")) {
        const JsonObject object(*quality, root.where() + ": quality");
        object.checkKeys({"ssim", "flip"});
        for (const auto& [key, every] :
             {std::pair<const char*, uint32_t*>{"ssim", &config.score.ssim_every}, {"flip", &config.score.flip_every}})
            if (const ParsedJson* value = object.find(key); value && !value->is_null())
                *every = uint32_t(
                    Value(object, key, *value).count(0, kMaxFrames, ": every so many scored frames, 0 = none"));
    }
}

} // namespace

SweepConfig parseSweepConfig(std::string_view json, const std::string& file, const RunConfig& base,
                             const std::vector<std::string>& backends)
{
    const ParsedJson parsed = parseJson(json, file, "a sweep (schemas/sweep.schema.json)");
    const JsonObject root(parsed, file);
    if (const std::string schema = root.text("schema"); schema != "gsc.sweep/1")
        root.fail("schema", "\"" + schema.substr(0, 40) + "\"", "\"gsc.sweep/1\"", "a newer player may read it");
    root.checkKeys({"schema", "trajectories", "size", "fov_degrees", "eyes", "frames", "warmup", "score_every",
                    "score_first", "quality", "axes", "runs"});
    SweepConfig config;
    readTrajectories(root, config);
    readFrames(root, config);
    const Settings settings = settingsFor(backends);
    if (const ParsedJson* axes = root.find("axes")) {
        config.runs = productOf(JsonObject(*axes, file + ": axes"), settings, base);
        config.matched = config.runs.front().reuse;
    }
    if (const ParsedJson* runs = root.find("runs")) {
        if (!runs->is_array() || runs->empty())
            root.fail("runs", shownJson(*runs), "an array of at least one run");
        for (size_t i = 0; i < runs->size(); ++i)
            config.runs.push_back(
                readRun(JsonObject((*runs)[i], formatString("%s: runs[%zu]", file.c_str(), i)), settings, base));
    }
    if (config.runs.empty())
        throw Error(ErrorCode::InvalidFile, file, "has neither \"axes\" nor \"runs\"", "at least one of them",
                    "add one");
    return config;
}

} // namespace gsc
