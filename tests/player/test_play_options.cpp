// SPDX-License-Identifier: Apache-2.0
#include <gsc/error.h>
#include "player/commands/play_command.h"
#include "player/frames/lod_target.h"
#include "player/options/play_options.h"
#include "runtime/cli/command_words.h"
#include "tests/support/temporary_folder.h"
#include "tests/format/tiny_gsc.h"

#include <CLI/CLI.hpp>

#include <doctest/doctest.h>

#include <fstream>
#include <initializer_list>
#include <numbers>
#include <vector>

using namespace gsc;

namespace {

// Exit code, or -1 if the options are to be played.
int parse(std::initializer_list<const char*> arguments, PlayOptions& options)
{
    std::vector<const char*> argv = {"gsc-play"};
    argv.insert(argv.end(), arguments);
    CLI::App app("", "gsc-play");
    addPlayOptions(app, options);
    try {
        (void)checkWords(app, {argv.begin() + 1, argv.end()});
        app.parse(int(argv.size()), argv.data());
        checkPlayOptions(app, options);
        return -1;
    } catch (const Error& e) {
        return int(e.code());
    }
}

int parse(std::initializer_list<const char*> arguments)
{
    PlayOptions options;
    return parse(arguments, options);
}

} // namespace

TEST_CASE("every option arrives")
{
    PlayOptions o;
    CHECK(parse({"m.gsc",
                 "--cameras",
                 "c.json",
                 "--tier",
                 "exact",
                 "--eyes",
                 "2",
                 "--ipd",
                 "0.06",
                 "--size",
                 "640x480",
                 "--fov",
                 "90",
                 "--out",
                 "{frame}_{eye}.pfm",
                 "--stats",
                 "s.jsonl",
                 "--backend",
                 "cpu",
                 "--threads",
                 "3",
                 "--appearance",
                 "5",
                 "--background",
                 "1,0.5,0",
                 "--near",
                 "0.3",
                 "--frames",
                 "2:9",
                 "-w",
                 "--verify",
                 "--ignore-distortion",
                 "--cameras-transform",
                 "undo"},
                o) == -1);
    CHECK(o.model.file == "m.gsc");
    CHECK(o.cameras.file == "c.json");
    CHECK(o.frame.tier == Tier::Exact);
    CHECK(o.view.eyes == 2);
    CHECK(o.view.ipd.value == 0.06);
    CHECK(o.view.ipd.unit == LengthUnit::World);
    CHECK(o.view.width == 640);
    CHECK(o.view.height == 480);
    CHECK(o.view.fov_x == doctest::Approx(std::numbers::pi / 2));
    CHECK(o.output.out == "{frame}_{eye}.pfm");
    CHECK(o.output.stats == "s.jsonl");
    CHECK(o.devices.backend == "cpu");
    CHECK(o.devices.threads == 3);
    CHECK(o.cameras.appearance == 5);
    REQUIRE(o.frame.background.has_value());
    CHECK((*o.frame.background)[1] == 0.5f);
    CHECK(o.frame.near_z == 0.3);
    CHECK(o.cameras.first == 2);
    CHECK(o.cameras.end == 9);
    CHECK(o.cameras.range == "--frames 2:9");
    CHECK(o.cameras.ignore_distortion);
    CHECK(o.cameras.transform == CamerasTransform::Undo);
    CHECK(o.output.overwrite);
    CHECK(o.model.verify);
}

TEST_CASE("defaults")
{
    PlayOptions o;
    CHECK(parse({"m.gsc"}, o) == -1);
    CHECK(o.cameras.file == "stored");
    CHECK(o.frame.tier == Tier::Fast);
    CHECK(o.view.eyes == 1);
    CHECK_FALSE(o.frame.background.has_value());
    CHECK(o.cameras.appearance == -1);
    CHECK(o.view.ipd.value == 0);
    CHECK(o.cameras.range.empty());
    CHECK_FALSE(o.cameras.ignore_distortion);
    CHECK(o.cameras.transform == CamerasTransform::Told);
    PlayOptions eyes; // the model or the trajectory may state the distance
    CHECK(parse({"m.gsc", "--eyes", "2"}, eyes) == -1);
    PlayOptions metres;
    CHECK(parse({"m.gsc", "--eyes", "2", "--ipd", "64mm"}, metres) == -1);
    CHECK(metres.view.ipd.value == 0.064);
    CHECK(metres.view.ipd.unit == LengthUnit::Metre);
}

TEST_CASE("wrong command lines exit with 1")
{
    CHECK(parse({}) == 1);
    CHECK(parse({"m.gsc", "--nonsense"}) == 1);
    CHECK(parse({"m.gsc", "other.gsc"}) == 1);
    CHECK(parse({"m.gsc", "--tier", "best"}) == 1);
    CHECK(parse({"m.gsc", "--eyes", "3", "--ipd", "1"}) == 1);
    CHECK(parse({"m.gsc", "--eyes", "2", "--ipd", "0"}) == 1);
    CHECK(parse({"m.gsc", "--eyes", "2", "--ipd", "64miles"}) == 1);
    CHECK(parse({"m.gsc", "--eyes", "2", "--ipd", "nan"}) == 1);
    CHECK(parse({"m.gsc", "--depth", "12"}) == 1);
    CHECK(parse({"m.gsc", "--fov", "180"}) == 1);
    CHECK(parse({"m.gsc", "--fov", "-3"}) == 1);
    CHECK(parse({"m.gsc", "--near", "-1"}) == 1);
    CHECK(parse({"m.gsc", "--background", "red"}) == 1);
    CHECK(parse({"m.gsc", "--background", "1,2"}) == 1);
    CHECK(parse({"m.gsc", "--background", "1,2,3,4"}) == 1);
    CHECK(parse({"m.gsc", "--background", "nan,0,0"}) == 1);
    CHECK(parse({"m.gsc", "--appearance", "-1"}) == 1);
    CHECK(parse({"m.gsc", "--threads", "-1"}) == 1);
    for (const char* size : {"0", "640x", "x480", "0x480", "640x480x3", "-1x5", "99999x5", "6 4x4", "1e3x10"})
        CHECK(parse({"m.gsc", "--size", size}) == 1);
    for (const char* frames : {"5:5", "7:2", "a:b", ":-1", "1:2:3", "1.5"})
        CHECK(parse({"m.gsc", "--frames", frames}) == 1);
    CHECK(parse({"m.gsc", "--out", "x.gif"}) == 5); // no such writer
}

TEST_CASE("what is kept between frames")
{
    PlayOptions o;
    CHECK(parse({"m.gsc", "--reuse", "depth", "--reuse-depth", "7", "--reuse-guidance", "staged", "--cache-budget",
                 "64M", "--lod-bias", "-1.5"},
                o) == -1);
    CHECK(o.frame.reuse.policy == ReusePolicy::Depth);
    CHECK(o.frame.reuse.max_depth == 7);
    CHECK(o.frame.reuse.guidance == DepthGuidance::Staged);
    CHECK(o.frame.reuse.cache_bytes == 64u << 20);
    CHECK(o.frame.lod_bias == -1.5);
    PlayOptions e;
    CHECK(parse({"m.gsc", "--backend", "cpu", "--reuse", "error", "--reuse-bound", "0.5", "--decode-budget", "1000"},
                e) == -1);
    CHECK(e.frame.reuse.policy == ReusePolicy::Error);
    CHECK(e.frame.reuse.bound == 0.5f);
    CHECK(e.frame.reuse.decode_budget == 1000);
    PlayOptions none;
    CHECK(parse({"m.gsc"}, none) == -1);
    CHECK(none.frame.reuse.policy == ReusePolicy::None);
    CHECK(none.frame.reuse.max_depth == 10);
    CHECK(none.frame.reuse.bound == 1);
    CHECK(none.frame.lod_bias == 0);
}

TEST_CASE("how levels are chosen")
{
    PlayOptions o;
    CHECK(parse({"m.gsc", "--lod-fade", "0.5", "--lod-hysteresis", "0.1", "--target-ms", "11", "--lod-bias", "-1"},
                o) == -1);
    CHECK(o.frame.lod_fade == 0.5);
    CHECK(o.frame.lod_hysteresis == 0.1);
    CHECK(o.frame.target_ms == 11);
    CHECK(o.frame.lod_bias == -1); // where the target starts
    PlayOptions none;
    CHECK(parse({"m.gsc"}, none) == -1);
    CHECK(none.frame.lod_fade == 0);
    CHECK(none.frame.lod_hysteresis == 0);
    CHECK(none.frame.target_ms == 0);
    for (const char* option : {"--lod-fade", "--lod-hysteresis"})
        for (const char* wrong : {"nan", "-0.1", "1.1", "inf", "x"})
            CHECK(parse({"m.gsc", option, wrong}) == 1);
    for (const char* wrong : {"0", "nan", "-5", "inf", "60001", "x"})
        CHECK(parse({"m.gsc", "--target-ms", wrong}) == 1);
}

TEST_CASE("detail: of --detail, or of the tier turbo, whichever comes first")
{
    const auto frame = [](std::initializer_list<const char*> arguments) {
        PlayOptions o;
        CHECK(parse(arguments, o) == -1);
        return o.frame;
    };
    CHECK(frame({"m.gsc"}).detail == 0);
    CHECK(frame({"m.gsc", "--tier", "fast"}).detail == 0);
    CHECK(frame({"m.gsc", "--tier", "turbo"}).tier == Tier::Fast);
    CHECK(frame({"m.gsc", "--tier", "turbo"}).detail == kTurboDetail);
    CHECK(frame({"m.gsc", "--detail", "1.5"}).tier == Tier::Fast);
    CHECK(frame({"m.gsc", "--detail", "1.5"}).detail == 1.5);
    CHECK(frame({"m.gsc", "--tier", "turbo", "--detail", "4"}).detail == 4);
    CHECK(frame({"m.gsc", "--detail", "4", "--tier", "turbo"}).detail == 4);
    CHECK(frame({"m.gsc", "--detail", "0", "--tier", "turbo"}).detail == 0);
    CHECK(frame({"m.gsc", "--detail", "8"}).detail == 8);
    CHECK(frame({"m.gsc", "--detail", "0", "--tier", "exact"}).tier == Tier::Exact);
    FrameChoice switched = frame({"m.gsc", "--tier", "turbo"});
    CHECK(switched.detailPixels() == kTurboDetail);
    switched.tier = Tier::Exact; // as the window does
    CHECK(switched.detailPixels() == 0);
    for (const char* wrong : {"-1", "64.5", "nan", "inf", "x", ""})
        CHECK(parse({"m.gsc", "--detail", wrong}) == 1);
}

TEST_CASE("detail goes with neither exact, nor reuse, nor shards")
{
    CHECK(parse({"m.gsc", "--tier", "exact", "--detail", "2"}) == 1);
    for (const char* policy : {"depth", "error"}) {
        CHECK(parse({"m.gsc", "--detail", "2", "--reuse", policy}) == 1);
        CHECK(parse({"m.gsc", "--tier", "turbo", "--reuse", policy}) == 1);
        CHECK(parse({"m.gsc", "--tier", "turbo", "--detail", "0", "--reuse", policy}) == -1);
    }
    CHECK(parse({"m.gsc", "--detail", "2", "--reuse", "none"}) == -1);
    CHECK(parse({"m.gsc", "--detail", "2", "--shard", "1/2", "--stats", "s"}) == 1);
    CHECK(parse({"m.gsc", "--tier", "turbo", "--shard", "1/2", "--stats", "s"}) == 1);
    CHECK(parse({"m.gsc", "--tier", "fast", "--shard", "1/2", "--stats", "s"}) == -1);
}

TEST_CASE("a target time takes no more detail away than --lod-bias may")
{
    const test::TemporaryFolder folder;
    PlayOptions options;
    options.model.file = folder / "model.gsc";
    for (const int32_t clamp : {1, 40}) {
        CAPTURE(clamp);
        test::TinyGscOptions tiny;
        tiny.levels = 2;
        std::vector<std::byte> file = test::tinyGsc(tiny);
        test::records<ModelParams>(file, kSectionParams)->level_clamp = clamp;
        test::reseal(file);
        std::ofstream(options.model.file, std::ios::binary)
            .write(reinterpret_cast<const char*>(file.data()), std::streamsize(file.size()));
        const auto scene = Scene::open(options.model.file);
        options.frame.target_ms = 0;
        CHECK_FALSE(frameGuard(*scene, options.frame, {true, true}));
        options.frame.target_ms = 1;
        for (const bool detail : {false, true}) {
            std::optional<FrameGuard> guard = frameGuard(*scene, options.frame, {detail, false});
            REQUIRE(guard);
            for (int i = 0; i < 10000; ++i)
                guard->add(1e6);
            CHECK(guard->lodBias() == (clamp == 1 ? -5 : -16)); // all levels, and four for what is nearer
            CHECK(guard->detail() == (detail ? 4 : 0));
        }
    }
}

TEST_CASE("reuse options out of range, or without their policy, exit with 1")
{
    for (const char* bound : {"-1", "nan", "inf", "256", "x"})
        CHECK(parse({"m.gsc", "--reuse", "error", "--reuse-bound", bound}) == 1);
    for (const char* bias : {"nan", "17", "-16.5", "inf"})
        CHECK(parse({"m.gsc", "--lod-bias", bias}) == 1);
    CHECK(parse({"m.gsc", "--reuse", "often"}) == 1);
    CHECK(parse({"m.gsc", "--reuse", "depth", "--reuse-depth", "-1"}) == 1);
    CHECK(parse({"m.gsc", "--reuse", "depth", "--reuse-depth", "1000001"}) == 1);
    CHECK(parse({"m.gsc", "--reuse", "depth", "--reuse-guidance", "cubic"}) == 1);
    CHECK(parse({"m.gsc", "--reuse", "error", "--decode-budget", "-5"}) == 1);
    CHECK(parse({"m.gsc", "--reuse", "error", "--cache-budget", "much"}) == 1);
    CHECK(parse({"m.gsc", "--reuse-depth", "4"}) == 1);
    CHECK(parse({"m.gsc", "--reuse", "error", "--reuse-depth", "4"}) == 1);
    CHECK(parse({"m.gsc", "--reuse", "error", "--reuse-guidance", "staged"}) == 1);
    CHECK(parse({"m.gsc", "--reuse", "depth", "--reuse-bound", "1"}) == 1);
    CHECK(parse({"m.gsc", "--decode-budget", "4"}) == 1);
    CHECK(parse({"m.gsc", "--reuse", "depth", "--decode-budget", "4"}) == 1);
    CHECK(parse({"m.gsc", "--cache-budget", "4M"}) == 1);
}

TEST_CASE("ranges")
{
    uint64_t first = 0, end = 0;
    CHECK(parseFrameRange(":3", first, end));
    CHECK(first == 0);
    CHECK(end == 3);
    CHECK(parseFrameRange("4:", first, end));
    CHECK(first == 4);
    CHECK(end == std::numeric_limits<uint64_t>::max());
    CHECK_FALSE(parseFrameRange("7", first, end)); // a count in other programs
    CHECK(first == 4);
}

TEST_CASE("what has no effect is refused")
{
    CHECK(parse({"m.gsc", "--ipd", "0.06"}) == 1);
    CHECK(parse({"m.gsc", "--depth", "16"}) == 1);
    CHECK(parse({"m.gsc", "--depth", "16", "--out", "{frame}.pfm"}) == 1);
    PlayOptions png;
    const int code = parse({"m.gsc", "--depth", "16", "--out", "{frame}.png"}, png);
    CHECK((code == -1 || code == 5)); // where the build writes none
    CHECK(png.output.depth == PixelDepth::Sixteen);
    CHECK(parse({"m.gsc", "--stereo", "merged"}) == 1);
    CHECK(parse({"m.gsc", "--fov", "0"}) == 1);
    CHECK(parse({"m.gsc", "--fov", "179.9"}) == -1);
    CHECK(parse({"m.gsc", "--backend", "gpu"}) == 1);
    CHECK(parse({"m.gsc", "--size", "1x1", "--size", "2x2"}) == 1);
    CHECK(parse({"m.gsc", "--out", "--stats", "s"}) == 1);
}
