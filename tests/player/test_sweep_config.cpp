// SPDX-License-Identifier: Apache-2.0
#include "player/measure/run_facts.h"
#include "player/sweep/sweep_config.h"

#include <gsc/error.h>

#include <doctest/doctest.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <string>
#include <vector>

using namespace gsc;

namespace {

SweepConfig parse(const std::string& json)
{
    return parseSweepConfig(json, "s.json", {}, {"cuda", "cpu"});
}

// With the keys that every sweep has.
SweepConfig withAxes(const std::string& axes, const std::string& more = "")
{
    return parse(R"({"schema":"gsc.sweep/1","trajectories":["stored"],"axes":{)" + axes + "}" + more + "}");
}

// "depth 5 linear match": what matters of a run, in a word each.
std::string word(const RunConfig& run)
{
    const nlohmann::ordered_json key = runKeyJson(run);
    std::string text;
    for (const auto& [name, value] : key.items())
        if (!value.is_null() && value != 0 && name != "tier" && name != "lod_bias" && name != "backend" &&
            value != "exact")
            text += " " + (value.is_string() ? value.get<std::string>() : value.dump());
    return text.substr(1);
}

std::vector<std::string> words(const SweepConfig& config)
{
    std::vector<std::string> all;
    for (const RunConfig& run : expandRuns(config))
        all.push_back(word(run));
    return all;
}

// Message of the Error, which must be InvalidFile; empty if nothing was wrong.
std::string refusal(const std::string& json)
{
    try {
        (void)expandRuns(parse(json));
    } catch (const Error& e) {
        CHECK(e.code() == ErrorCode::InvalidFile);
        return e.what();
    }
    return {};
}

} // namespace

using Words = std::vector<std::string>;

TEST_CASE("axes that the policy takes no notice of fall together")
{
    CHECK(words(withAxes(R"("policy":["none","depth","error"],"max_depth":[5,10],"guidance":["linear","staged"],
                            "bound":[0.5,2])")) == Words{"none", "depth 5 linear", "depth 5 staged", "depth 10 linear",
                                                         "depth 10 staged", "error 0.5", "error 2.0"});
    // nothing is kept, so there is no budget
    CHECK(words(withAxes(R"("policy":["none"],"decode_budget":[null,100],"cache_budget":[null,1000])")) ==
          Words{"none"});
    CHECK(words(withAxes(R"("policy":["error"],"decode_budget":[null,100],"cache_budget":[null,1000])")).size() == 4);
}

TEST_CASE("one decode for both eyes is swept beside no reuse and depth")
{
    CHECK(words(withAxes(R"("policy":["none","depth"],"stereo":["merged"])")) ==
          Words{"merged none", "merged depth 10 linear"});
    CHECK(words(withAxes(R"("policy":["none","error"],"stereo":["exact","merged"])")) ==
          Words{"none", "error 1.0", "merged none"});
    CHECK(refusal(R"({"schema":"gsc.sweep/1","trajectories":["stored"],
                               "axes":{"policy":["error"],"stereo":["merged"]}})")
              .find("stereo merged") != std::string::npos);
}

TEST_CASE("equal runs are there once, listed ones too")
{
    CHECK(words(withAxes(R"("policy":["none","none"],"bound":[1,1.0])",
                         R"(,"runs":[{"policy":"none","bound":9},{"policy":"error","bound":3},{"policy":"none"}])")) ==
          Words{"none", "error 3.0"});
    const SweepConfig listed =
        parse(R"({"schema":"gsc.sweep/1","trajectories":["a"],"runs":[{"policy":"depth","max_depth":3}]})");
    CHECK(words(listed) == Words{"depth 3 linear"});
}

TEST_CASE("tiers, level biases and backends multiply, backends stay together")
{
    const SweepConfig config = withAxes(R"("tier":["exact","fast"],"lod_bias":[0,-1],"backend":["cpu","cuda"])",
                                        R"(,"runs":[{"policy":"error","backend":"cpu"}])");
    const std::vector<RunConfig> runs = expandRuns(config);
    REQUIRE(runs.size() == 9);
    CHECK(std::count_if(runs.begin(), runs.end(), [](const RunConfig& r) { return r.backend == "cpu"; }) == 5);
    CHECK(std::is_sorted(runs.begin(), runs.end(),
                         [](const RunConfig& a, const RunConfig& b) { return a.backend < b.backend; }));
    CHECK(runs[1].lod_bias == -1);
    CHECK(runs[2].tier == Tier::Fast);
}

TEST_CASE("transitions and hystereses multiply, and are in the key of a run")
{
    const SweepConfig config = withAxes(R"("lod_fade":[0,0.25,1],"lod_hysteresis":[0,0.1])",
                                        R"(,"runs":[{"lod_fade":0.25},{"lod_hysteresis":0.5}])");
    const std::vector<RunConfig> runs = expandRuns(config);
    REQUIRE(runs.size() == 7);
    CHECK(runKeyJson(runs[0])["lod_fade"] == 0);
    CHECK(runKeyJson(runs[0])["lod_hysteresis"] == 0);
    CHECK(runs[1].lod_hysteresis == 0.1);
    CHECK(runKeyJson(runs[1])["lod_hysteresis"] == 0.1);
    CHECK(runs[4].lod_fade == 1);
    CHECK(runKeyJson(runs[4])["lod_fade"] == 1);
    CHECK(runs[6].lod_hysteresis == 0.5);
    RunConfig base;
    base.lod_fade = 0.75;
    const SweepConfig rest =
        parseSweepConfig(R"({"schema":"gsc.sweep/1","trajectories":["a"],"axes":{"bound":[2]}})", "s", base, {"cpu"});
    CHECK(expandRuns(rest)[0].lod_fade == 0.75);
}

TEST_CASE("foveation is an axis: 0 is without it, and tier exact has none")
{
    const SweepConfig config =
        withAxes(R"("tier":["fast","exact"],"fovea_pixels":[0,1.5,2])", R"(,"runs":[{"fovea_pixels":2}])");
    const std::vector<RunConfig> runs = expandRuns(config);
    REQUIRE(runs.size() == 4); // exact once
    CHECK(runs[0].foveaPixels() == 0);
    CHECK(runKeyJson(runs[0])["fovea_pixels"] == 0);
    CHECK(runs[1].foveation == FoveationMode::Fixed);
    CHECK(runKeyJson(runs[1])["fovea_pixels"] == 1.5);
    CHECK(runKeyJson(runs[2])["fovea_pixels"] == 2);
    CHECK(runs[3].tier == Tier::Exact);
    CHECK(runs[3].foveaPixels() == 0);
    // what the command line says holds where the file says nothing
    RunConfig base;
    base.foveation = FoveationMode::Fixed;
    base.fovea_pixels = 3;
    const std::vector<RunConfig> rest = expandRuns(parseSweepConfig(
        R"({"schema":"gsc.sweep/1","trajectories":["a"],"runs":[{},{"fovea_pixels":0},{"tier":"exact"}]})", "s", base,
        {"cpu"}));
    REQUIRE(rest.size() == 3);
    CHECK(rest[0].foveaPixels() == 3);
    CHECK(rest[1].foveaPixels() == 0);
    CHECK(rest[2].foveaPixels() == 0);
}

TEST_CASE("detail is an axis, and the tier turbo stands for one")
{
    const auto details = [](const SweepConfig& config) {
        std::vector<double> list;
        for (const RunConfig& run : expandRuns(config))
            list.push_back(run.tier == Tier::Exact ? -1 : run.detail);
        return list;
    };
    using List = std::vector<double>;
    CHECK(details(withAxes(R"("tier":["exact","fast","turbo"])")) == List{-1, 0, 2});
    CHECK(details(withAxes(R"("detail":[0,1,2,4],"tier":["exact","fast","turbo"])")) == List{-1, 0, 1, 2, 4});
    // it keeps what reuse would keep
    CHECK(details(withAxes(R"("detail":[0,2],"policy":["none","depth"],"max_depth":[3,4])")) == List{0, 0, 0, 2});
    CHECK(details(withAxes(R"("detail":[0])", R"(,"runs":[{"tier":"turbo"},{"tier":"turbo","detail":4},{}])")) ==
          List{0, 2, 4});
    const std::vector<RunConfig> runs = expandRuns(withAxes(R"("tier":["fast","turbo"])"));
    CHECK(runKeyJson(runs[0])["detail"] == 0);
    CHECK(runKeyJson(runs[1])["detail"] == 2);
    CHECK(runKeyJson(runs[1])["tier"] == "fast");
    // what the command line says holds where the file says nothing
    RunConfig base;
    base.detail = 3;
    const auto with = [&](const char* list) {
        return details(parseSweepConfig(
            std::string(R"({"schema":"gsc.sweep/1","trajectories":["a"],"runs":)") + list + "}", "s", base, {"cpu"}));
    };
    CHECK(with(R"([{},{"detail":0},{"lod_bias":1},{"tier":"exact"}])") == List{3, 0, 3, -1});
    CHECK(refusal(R"({"schema":"gsc.sweep/1","trajectories":["a"],"axes":{"policy":["error"],"detail":[2]}})")
              .find("the detail 0") != std::string::npos);
}

TEST_CASE("a matched budget comes after the run it is taken from")
{
    const std::string axes = R"("policy":["error","depth"],"max_depth":[7,10],"guidance":["staged"])";
    const SweepConfig both = withAxes(axes + R"(,"decode_budget":["match",null])");
    CHECK(words(both) == Words{"error 1.0", "depth 7 staged", "depth 10 staged", "error 1.0 match",
                               "depth 7 staged match", "depth 10 staged match"});
    // without anybody asking for that run it is there, levels chosen as in the run that needs it
    const SweepConfig alone = withAxes(
        R"("policy":["error"],"max_depth":[7],"guidance":["staged"],"decode_budget":["match"],"lod_fade":[0.5])");
    CHECK(words(alone) == Words{"0.5 depth 7 staged", "0.5 error 1.0 match"});
    const RunConfig depth = depthRunOf(alone, expandRuns(alone)[1]);
    CHECK(runKeyJson(depth) == runKeyJson(expandRuns(alone)[0]));
    CHECK_FALSE(depth.match_budget);
}

TEST_CASE("what is left out is the command line's")
{
    RunConfig base;
    base.backend = "cpu";
    base.reuse.policy = ReusePolicy::Error;
    base.reuse.bound = 4;
    base.lod_bias = -2;
    const SweepConfig config = parseSweepConfig(
        R"({"schema":"gsc.sweep/1","trajectories":["a"],"axes":{"max_depth":[3]},"runs":[{"bound":2}]})", "s", base,
        {"cpu"});
    CHECK(words(config) == Words{"error 4.0", "error 2.0"});
    CHECK(expandRuns(config)[0].lod_bias == -2);
    CHECK(expandRuns(config)[0].backend == "cpu");
    CHECK(config.warmup == 5);
    CHECK(config.width == 0);
}

TEST_CASE("frames and quality")
{
    const SweepConfig config = parse(R"({"schema":"gsc.sweep/1","trajectories":["a.json","stored"],"size":[64,48],
        "fov_degrees":90,"eyes":2,"frames":7,"warmup":0,"quality":{"ssim":4,"flip":null},"axes":{}})");
    CHECK(config.trajectories == Words{"a.json", "stored"});
    CHECK(config.width == 64);
    CHECK(config.height == 48);
    CHECK(config.fov_degrees == 90);
    CHECK(config.eyes == 2);
    CHECK(config.frames == 7);
    CHECK(config.warmup == 0);
    CHECK(config.score.ssim_every == 4);
    CHECK(config.score.flip_every == 0);
    CHECK(config.score.every == 1);
    CHECK(config.score.first == 0);
    const ScoreOptions some =
        parse(R"({"schema":"gsc.sweep/1","trajectories":["a"],"score_every":5,"score_first":2,"axes":{}})").score;
    CHECK(some.every == 5);
    CHECK(some.first == 2);
    CHECK_FALSE(some.scores(0));
    CHECK(some.scores(2));
    CHECK(some.scores(7));
    CHECK_FALSE(some.scores(8));
    CHECK(some.scoredOf(2) == 0);
    CHECK(some.scoredOf(7) == 1);
    CHECK(some.scoredOf(8) == 2);
    CHECK(words(config) == Words{"none"});
    CHECK(parse(R"({"schema":"gsc.sweep/1","trajectories":["a"],"size":null,"frames":null,"axes":{}})").frames == 0);
}

TEST_CASE("wrong files are refused with the place and what was expected")
{
    const std::string head = R"({"schema":"gsc.sweep/1","trajectories":["stored"])";
    const struct {
        std::string json;
        const char *place, *expected;
    } cases[] = {
        {"[]", "s.json", "an object"},
        {"{", "s.json", "a sweep"},
        {"{}", "\"schema\"", "missing"},
        {R"({"schema":"gsc.sweep/2"})", "\"schema\"", "gsc.sweep/1"},
        {R"({"schema":"gsc.sweep/1","axes":{}})", "\"trajectories\"", "missing"},
        {R"({"schema":"gsc.sweep/1","trajectories":[],"axes":{}})", "\"trajectories\"", "at least one"},
        {R"({"schema":"gsc.sweep/1","trajectories":["a",3],"axes":{}})", "\"trajectories[1]\"", "path"},
        {head + "}", "s.json", "\"axes\""},
        {head + R"(,"axis":{}})", "\"axis\"", "not known"},
        {head + R"(,"axes":[]})", "s.json: axes", "an object"},
        {head + R"(,"axes":{"policy":[]}})", "axes: key \"policy\"", "at least one value"},
        {head + R"(,"axes":{"policy":"none"}})", "axes: key \"policy\"", "an array"},
        {head + R"(,"axes":{"policy":["none","always"]}})", "axes: key \"policy[1]\"", "\"depth\", \"error\""},
        {head + R"(,"axes":{"colour":[1]}})", "axes: key \"colour\"", "not known"},
        {head + R"(,"axes":{"max_depth":[1.5]}})", "\"max_depth[0]\"", "an integer"},
        {head + R"(,"axes":{"max_depth":[-1]}})", "\"max_depth[0]\"", "an integer from 0"},
        {head + R"(,"axes":{"guidance":["cubic"]}})", "\"guidance[0]\"", "\"staged\""},
        {head + R"(,"axes":{"bound":[1,NaN]}})", "\"bound[1]\"", "a number from 0 to 255"},
        {head + R"(,"axes":{"bound":["1"]}})", "\"bound[0]\"", "a number"},
        {head + R"(,"axes":{"decode_budget":["all"]}})", "\"decode_budget[0]\"", "\"match\""},
        {head + R"(,"axes":{"decode_budget":[0]}})", "\"decode_budget[0]\"", "null for no limit"},
        {head + R"(,"axes":{"cache_budget":["1M"]}})", "\"cache_budget[0]\"", "bytes"},
        {head + R"(,"axes":{"cut":[true]}})", "\"cut\"", "not known"},
        {head + R"(,"axes":{"tier":["best"]}})", "\"tier[0]\"", "\"exact\", \"fast\", \"turbo\""},
        {head + R"(,"axes":{"detail":[2,-1]}})", "\"detail[1]\"", "0 = everything"},
        {head + R"(,"axes":{"detail":[9]}})", "\"detail[0]\"", "0 to 8"},
        {head + R"(,"axes":{"lod_hysteresis":[1.5]}})", "\"lod_hysteresis[0]\"", "0 to 1"},
        {head + R"(,"axes":{"detail":[null]}})", "\"detail[0]\"", "a number"},
        {head + R"(,"runs":[{"detail":2,"tier":"exact"}]})", "\"detail\"", "\"turbo\""},
        {head + R"(,"runs":[{"detail":2,"policy":"depth"}]})", "\"policy\"", "\"none\""},
        {head + R"(,"runs":[{"policy":"error","tier":"turbo"}]})", "\"policy\"", "the detail 0"},
        {head + R"(,"axes":{"lod_fade":[1.5]}})", "\"lod_fade[0]\"", "0 to 1"},
        {head + R"(,"runs":[{"lod_hysteresis":-0.5}]})", "\"lod_hysteresis\"", "0 to 1"},
        {head + R"(,"axes":{"lod_bias":[17]}})", "\"lod_bias[0]\"", "-16 to 16"},
        {head + R"(,"axes":{"fovea_pixels":[2,-1]}})", "\"fovea_pixels[1]\"", "0 = without foveation"},
        {head + R"(,"axes":{"fovea_pixels":[101]}})", "\"fovea_pixels[0]\"", "0 to 100"},
        {head + R"(,"axes":{"fovea_pixels":[null]}})", "\"fovea_pixels[0]\"", "a number"},
        {head + R"(,"runs":[{"fovea_pixels":2,"tier":"exact"}]})", "\"fovea_pixels\"", "\"fast\""},
        {head + R"(,"axes":{"stereo":["shared"]}})", "\"stereo[0]\"", "\"merged\""},
        {head + R"(,"runs":[{"stereo":"merged","policy":"error"}]})", "\"stereo\"", "\"none\""},
        {head + R"(,"axes":{"backend":["tpu"]}})", "\"backend[0]\"", "\"cuda\", \"cpu\""},
        {head + R"(,"runs":[]})", "\"runs\"", "at least one run"},
        {head + R"(,"runs":[{},{"policy":4}]})", "runs[1]: key \"policy\"", "\"none\""},
        {head + R"(,"runs":[{"depth":4}]})", "runs[0]: key \"depth\"", "max_depth"},
        {head + R"(,"runs":[7]})", "runs[0]", "an object"},
        {head + R"(,"axes":{},"size":[0,5]})", "\"size[0]\"", "1 to 32768"},
        {head + R"(,"axes":{},"size":[40000,5]})", "\"size[0]\"", "1 to 32768"},
        {head + R"(,"axes":{},"size":[5]})", "\"size\"", "[width, height]"},
        {head + R"(,"axes":{},"frames":0})", "\"frames\"", "an integer from 1"},
        {head + R"(,"axes":{},"eyes":3})", "\"eyes\"", "from 1 to 2"},
        {head + R"(,"axes":{},"fov_degrees":180})", "\"fov_degrees\"", "0.01 to 179.9"},
        {head + R"(,"axes":{},"quality":{"lpips":1}})", "quality: key \"lpips\"", "not known"},
        {head + R"(,"axes":{},"score_every":0})", "score_every", "from 1"},
        {head + R"(,"axes":{},"score_first":-1})", "score_first", "from 0"},
        {head + R"(,"axes":{},"quality":{"ssim":-1}})", "quality: key \"ssim\"", "0 = none"},
    };
    for (const auto& c : cases) {
        CAPTURE(c.json);
        const std::string message = refusal(c.json);
        CAPTURE(message);
        CHECK(message.find(c.place) != std::string::npos);
        CHECK(message.find(c.expected) != std::string::npos);
        CHECK(message.find("s.json") == 0);
    }
}

TEST_CASE("a product that never ends is refused")
{
    std::string values;
    for (int i = 0; i < 400; ++i)
        values += (i ? "," : "") + std::to_string(i);
    const std::string json = R"({"schema":"gsc.sweep/1","trajectories":["a"],"axes":{"max_depth":[)" + values +
                             R"(],"cache_budget":[null],"bound":[)" + "0.5" + R"(],"lod_bias":[0]}})";
    CHECK(refusal(json).empty());
    std::string bounds;
    for (int i = 0; i < 251; ++i)
        bounds += (i ? "," : "") + std::to_string(i);
    try {
        (void)expandRuns(withAxes(R"("max_depth":[)" + values + R"(],"bound":[)" + bounds + "]"));
        FAIL("accepted");
    } catch (const Error& e) {
        CHECK(e.code() == ErrorCode::InvalidFile);
        CHECK(std::string(e.what()).find("100000") != std::string::npos);
    }
}
