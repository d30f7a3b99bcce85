// SPDX-License-Identifier: Apache-2.0
#include "player/sweep/sweep_config.h"

#include "format/error.h"
#include "format/file/read_file.h"
#include "player/json_fields.h"
#include "player/report/reuse_names.h"

#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <memory>

namespace gsc {

namespace {

constexpr size_t kMaxConfigBytes = 16 << 20;
constexpr double kMaxCount = 1e15; // of anchors and bytes
constexpr uint32_t kMaxFrames = 1000000;

const std::vector<std::pair<std::string, Tier>>& tiers()
{
    static const std::vector<std::pair<std::string, Tier>> names = {{"exact", Tier::Exact}, {"fast", Tier::Fast}};
    return names;
}

// A value of a run by itself or one in the list of an axis; `where` names the key, with its index in a list.
class Value {
public:
    Value(const JsonObject& object, std::string where, const Json& value)
        : m_object(object), m_where(std::move(where)), m_value(value)
    {
    }

    [[noreturn]] void fail(const std::string& expected) const
    {
        m_object.fail(m_where.c_str(), shownJson(m_value), expected);
    }
    [[nodiscard]] bool isNull() const { return m_value.is_null(); }
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
    const Json& m_value;
};

// The readers of each value, the same for an axis and for a run.
class Reader {
public:
    explicit Reader(const std::vector<std::string>& backends)
    {
        for (const std::string& name : backends)
            m_backends.emplace_back(name, name);
    }

    static ReusePolicy policy(const Value& v) { return v.word(reusePolicies()); }
    static uint32_t depth(const Value& v) { return uint32_t(v.count(0, kMaxReuseDepth, " frames")); }
    static DepthGuidance guidance(const Value& v) { return v.word(depthGuidances()); }
    static float bound(const Value& v) { return float(v.number(0, kMaxReuseBound, "in 1/255")); }
    static SweepAxes::Budget decodeBudget(const Value& v)
    {
        if (v.isText("match"))
            return {0, true};
        return {v.isNull() ? 0 : v.count(1, kMaxCount, " anchors, null for no limit, or \"match\""), false};
    }
    static uint64_t cacheBudget(const Value& v)
    {
        return v.isNull() ? 0 : v.count(1, kMaxCount, " bytes, or null for a quarter of the machine's");
    }
    static Tier tier(const Value& v) { return v.word(tiers()); }
    static double lodBias(const Value& v) { return v.number(-kMaxLodBias, kMaxLodBias, "levels"); }
    static double lodWidth(const Value& v) { return v.number(0, kMaxLodWidth, "levels"); }
    static StereoMode stereo(const Value& v) { return v.word(stereoModes()); }
    [[nodiscard]] std::string backend(const Value& v) const { return v.word(m_backends); }

private:
    std::vector<std::pair<std::string, std::string>> m_backends;
};

constexpr std::initializer_list<const char*> kRunKeys = {"policy",        "max_depth",      "guidance", "bound",
                                                         "decode_budget", "cache_budget",   "tier",     "lod_bias",
                                                         "lod_fade",      "lod_hysteresis", "stereo",   "backend"};

template <typename T, typename Read>
void readAxis(const JsonObject& axes, const char* key, std::vector<T>& out, T fallback, const Read& read)
{
    const Json* list = axes.find(key);
    if (!list) {
        out.push_back(std::move(fallback));
        return;
    }
    if (!list->is_array() || list->empty())
        axes.fail(key, shownJson(*list), "an array of at least one value");
    for (size_t i = 0; i < list->size(); ++i)
        out.push_back(read(Value(axes, formatString("%s[%zu]", key, i), (*list)[i])));
}

void readAxes(const JsonObject& object, const Reader& reader, const RunConfig& base, SweepAxes& axes)
{
    object.checkKeys(kRunKeys);
    const ReuseOptions& reuse = base.reuse;
    readAxis(object, "policy", axes.policies, reuse.policy, Reader::policy);
    readAxis(object, "max_depth", axes.depths, reuse.max_depth, Reader::depth);
    readAxis(object, "guidance", axes.guidances, reuse.guidance, Reader::guidance);
    readAxis(object, "bound", axes.bounds, reuse.bound, Reader::bound);
    readAxis(object, "decode_budget", axes.decode_budgets, {reuse.decode_budget, base.match_budget},
             Reader::decodeBudget);
    readAxis(object, "cache_budget", axes.cache_budgets, reuse.cache_bytes, Reader::cacheBudget);
    readAxis(object, "tier", axes.tiers, base.tier, Reader::tier);
    readAxis(object, "lod_bias", axes.lod_biases, base.lod_bias, Reader::lodBias);
    readAxis(object, "lod_fade", axes.lod_fades, base.lod_fade, Reader::lodWidth);
    readAxis(object, "lod_hysteresis", axes.lod_hystereses, base.lod_hysteresis, Reader::lodWidth);
    readAxis(object, "stereo", axes.stereos, base.stereo, Reader::stereo);
    readAxis(object, "backend", axes.backends, base.backend, [&](const Value& v) { return reader.backend(v); });
}

RunConfig readRun(const JsonObject& object, const Reader& reader, const RunConfig& base)
{
    object.checkKeys(kRunKeys);
    RunConfig run = base;
    const auto read = [&](const char* key, const auto& take) {
        if (const Json* value = object.find(key))
            take(Value(object, key, *value));
    };
    read("policy", [&](const Value& v) { run.reuse.policy = Reader::policy(v); });
    read("max_depth", [&](const Value& v) { run.reuse.max_depth = Reader::depth(v); });
    read("guidance", [&](const Value& v) { run.reuse.guidance = Reader::guidance(v); });
    read("bound", [&](const Value& v) { run.reuse.bound = Reader::bound(v); });
    read("decode_budget", [&](const Value& v) {
        const SweepAxes::Budget budget = Reader::decodeBudget(v);
        run.reuse.decode_budget = budget.anchors;
        run.match_budget = budget.match;
    });
    read("cache_budget", [&](const Value& v) { run.reuse.cache_bytes = Reader::cacheBudget(v); });
    read("tier", [&](const Value& v) { run.tier = Reader::tier(v); });
    read("lod_bias", [&](const Value& v) { run.lod_bias = Reader::lodBias(v); });
    read("lod_fade", [&](const Value& v) { run.lod_fade = Reader::lodWidth(v); });
    read("lod_hysteresis", [&](const Value& v) { run.lod_hysteresis = Reader::lodWidth(v); });
    read("stereo", [&](const Value& v) { run.stereo = Reader::stereo(v); });
    read("backend", [&](const Value& v) { run.backend = reader.backend(v); });
    if (run.stereo == StereoMode::Merged && run.reuse.policy == ReusePolicy::Error)
        object.fail("stereo", "\"merged\" with a policy that bounds the change for each eye",
                    "\"exact\", or the policy \"depth\" or \"none\"");
    return run;
}

void readTrajectories(const JsonObject& root, SweepConfig& config)
{
    const Json& list = root.at("trajectories");
    if (!list.is_array() || list.empty())
        root.fail("trajectories", shownJson(list), "an array of at least one camera file or \"stored\"");
    for (size_t i = 0; i < list.size(); ++i) {
        if (!list[i].is_string() || list[i].get<std::string>().empty())
            root.fail(formatString("trajectories[%zu]", i).c_str(), shownJson(list[i]),
                      "the path of a camera file or \"stored\"");
        config.trajectories.push_back(list[i].get<std::string>());
    }
}

// What the file says about the frames; null is as good as nothing.
void readFrames(const JsonObject& root, SweepConfig& config)
{
    const auto given = [&](const char* key) {
        const Json* value = root.find(key);
        return value && !value->is_null() ? value : nullptr;
    };
    if (const Json* size = given("size")) {
        if (!size->is_array() || size->size() != 2)
            root.fail("size", shownJson(*size), "[width, height] or null");
        config.width = uint32_t(Value(root, "size[0]", (*size)[0]).count(1, kMaxImageSide, " pixels"));
        config.height = uint32_t(Value(root, "size[1]", (*size)[1]).count(1, kMaxImageSide, " pixels"));
    }
    if (const Json* fov = given("fov_degrees"))
        config.fov_degrees = Value(root, "fov_degrees", *fov).number(0.01, 179.9, "or null");
    if (const Json* eyes = given("eyes"))
        config.eyes = int(Value(root, "eyes", *eyes).count(1, 2, ""));
    if (const Json* frames = given("frames"))
        config.frames = Value(root, "frames", *frames).count(1, kMaxFrames, " or null for all");
    if (const Json* warmup = given("warmup"))
        config.warmup = uint32_t(Value(root, "warmup", *warmup).count(0, kMaxFrames, " frames"));
    if (const Json* quality = given("quality")) {
        const JsonObject object(*quality, root.where() + ": quality");
        object.checkKeys({"ssim", "flip"});
        for (const auto& [key, every] :
             {std::pair<const char*, uint32_t*>{"ssim", &config.score.ssim_every}, {"flip", &config.score.flip_every}})
            if (const Json* value = object.find(key); value && !value->is_null())
                *every = uint32_t(Value(object, key, *value).count(0, kMaxFrames, ": every so many frames, 0 = none"));
    }
}

} // namespace

SweepConfig parseSweepConfig(std::string_view json, const std::string& file, const RunConfig& base,
                             const std::vector<std::string>& backends)
{
    const Json parsed = parseJson(json, file, "a sweep (schemas/sweep.schema.json)");
    const JsonObject root(parsed, file);
    if (const std::string schema = root.text("schema"); schema != "gsc.sweep/1")
        root.fail("schema", "\"" + schema.substr(0, 40) + "\"", "\"gsc.sweep/1\"; a newer player may read it");
    root.checkKeys(
        {"schema", "trajectories", "size", "fov_degrees", "eyes", "frames", "warmup", "quality", "axes", "runs"});
    SweepConfig config;
    readTrajectories(root, config);
    readFrames(root, config);
    const Reader reader(backends);
    if (const Json* axes = root.find("axes")) {
        config.has_axes = true;
        readAxes(JsonObject(*axes, file + ": axes"), reader, base, config.axes);
    }
    if (const Json* runs = root.find("runs")) {
        if (!runs->is_array() || runs->empty())
            root.fail("runs", shownJson(*runs), "an array of at least one run");
        for (size_t i = 0; i < runs->size(); ++i)
            config.runs.push_back(
                readRun(JsonObject((*runs)[i], formatString("%s: runs[%zu]", file.c_str(), i)), reader, base));
    }
    if (!config.has_axes && config.runs.empty())
        throw Error(ErrorCode::InvalidFile,
                    file + ": has neither \"axes\" nor \"runs\", expected at least one of them; add one");
    return config;
}

SweepConfig readSweepConfig(const std::string& path, const RunConfig& base, const std::vector<std::string>& backends)
{
    const std::string text = readInputText(path, kMaxConfigBytes, "a sweep (schemas/sweep.schema.json)");
    return parseSweepConfig(text, path, base, backends);
}

} // namespace gsc
