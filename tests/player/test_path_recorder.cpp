// SPDX-License-Identifier: Apache-2.0
#include <gsc/error.h>
#include "runtime/cameras/camera_file.h"
#include "player/window/navigation.h"
#include "player/window/path_recorder.h"
#include "tests/player/window_cameras.h"
#include "tests/support/outcome.h"
#include "tests/support/temporary_folder.h"

#include <doctest/doctest.h>

#include <glm/geometric.hpp>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>
#include <string>
#include <vector>

using namespace gsc;
using namespace gsc::test;

namespace {

constexpr double kNoOrigin[3] = {};

bool sameEye(const Camera& a, const Camera& b)
{
    const EyeParams one = eyeParams(a, kNoOrigin), other = eyeParams(b, kNoOrigin);
    const EyeParams64 one64 = eyeParams64(a, kNoOrigin), other64 = eyeParams64(b, kNoOrigin);
    return std::memcmp(&one, &other, sizeof(one)) == 0 && std::memcmp(&one64, &other64, sizeof(one64)) == 0;
}

glm::dvec3 positionOf(const Camera& camera)
{
    return poseOf(camera).value().position;
}

} // namespace

TEST_CASE("a recording of a flight comes back bit for bit where the rates agree, both eyes of it too")
{
    const TemporaryFolder folder;
    const std::string path = folder / "flight.json";
    NavigationWorld world;
    world.high[0] = 700;
    Navigator navigator(world);
    const Camera lens = windowCamera({0, 0, 0});
    PathRecorder recorder;
    CHECK_FALSE(recorder.records());
    recorder.start("a \"flight\"", 90, 1.7);
    CHECK(recorder.records());
    std::vector<Camera> seen;
    const double begin = 123456.789; // time of a clock that runs since yesterday
    for (int i = 0; i < 400; ++i) {
        NavigationInput input;
        input.seconds = 1.0 / 90;
        input.move[2] = 1;
        input.look_rate[0] = 0.31 * std::sin(i * 0.1);
        input.look_rate[1] = 0.1;
        navigator.step(input);
        if (i == 200)
            navigator.jumpTo(turnedCamera({1e5, -3e-7, 1.0 / 3}, 1, 2, 3));
        seen.push_back(navigator.camera(lens));
        seen.back().appearance = i % 5 == 0 ? i : -1;
        CHECK(recorder.add(begin + i / 90.0, seen.back(), 0.1));
    }
    seen[3].name = "of no interest";
    CHECK(recorder.frames() == 400);
    CHECK(recorder.stop(path) == 400);
    CHECK_FALSE(recorder.records());

    TrajectoryFacts facts;
    std::vector<Camera> read = readCameraFile(path, &facts);
    CHECK(facts.name == "a \"flight\"");
    CHECK(facts.ipd == 0.1);
    CHECK(facts.views.empty());
    REQUIRE(read.size() == seen.size());
    size_t same = 0, same_eyes = 0;
    for (size_t i = 0; i < read.size(); ++i) {
        finishCamera(read[i], 0, 0, 0); // as the player does
        same += sameEye(read[i], seen[i]) && read[i].appearance == seen[i].appearance;
        Camera eyes[2], wanted[2];
        stereoPair(read[i], facts.ipd, eyes[0], eyes[1]);
        stereoPair(seen[i], 0.1, wanted[0], wanted[1]);
        same_eyes += sameEye(eyes[0], wanted[0]) && sameEye(eyes[1], wanted[1]);
    }
    CHECK(same == 400);
    CHECK(same_eyes == 400);

    const nlohmann::json json = nlohmann::json::parse(std::ifstream(path));
    CHECK(json.at("schema") == "gsc.trajectory/1");
    CHECK(json.at("fps") == 90);
    CHECK(json.at("metre") == 1.7);
    CHECK(json.at("frames")[9].at("time") == 0.1);
}

TEST_CASE("another rate than the screen's: frames between samples, the samples themselves where times meet")
{
    const TemporaryFolder folder;
    PathRecorder recorder;
    recorder.start("slow", 10);
    const std::vector<Camera> samples = {turnedCamera({0, 0, 0}, 0, 0), turnedCamera({4, 0, 0}, 0.4, 0),
                                         turnedCamera({4, 8, 0}, 0.4, 0.6)};
    CHECK(recorder.add(5, samples[0], 0));
    CHECK(recorder.add(5.4, samples[1], 0));
    CHECK(recorder.add(5.75, samples[2], 0)); // 5.7 is the last frame
    CHECK(recorder.stop(folder / "slow.json") == 8);
    const std::vector<Camera> read = readCameraFile(folder / "slow.json");
    REQUIRE(read.size() == 8);
    CHECK(sameEye(read[0], samples[0]));
    CHECK(sameEye(read[4], samples[1]));
    CHECK(length(positionOf(read[1]) - glm::dvec3(1, 0, 0)) < 1e-12);
    CHECK(length(positionOf(read[6]) - glm::dvec3(4, 8 * 0.2 / 0.35, 0)) < 1e-12);
    const CameraPose turned = poseOf(turnedCamera({0, 0, 0}, 0.3, 0)).value(), third = poseOf(read[3]).value();
    for (int i = 0; i < 3; ++i)
        CHECK(length(third.axes[i] - turned.axes[i]) < 1e-12);

    // fewer frames than samples
    recorder.start("fast", 10);
    for (int i = 0; i <= 100; ++i)
        CHECK(recorder.add(i * 0.01, windowCamera({double(i), 0, 0}), 0));
    CHECK(recorder.stop(folder / "fast.json") == 11);
    const std::vector<Camera> fast = readCameraFile(folder / "fast.json");
    for (size_t i = 0; i < fast.size(); ++i)
        CHECK(sameEye(fast[i], windowCamera({10.0 * double(i), 0, 0})));
}

TEST_CASE("a lens that changes is followed, its angles not across a change of size")
{
    const TemporaryFolder folder;
    PathRecorder recorder;
    recorder.start("zoom", 2);
    Camera wide = windowCamera({0, 0, 0}), narrow = wide, small = wide;
    narrow.fov_x = 0.5;
    narrow.fov_y = 0.3;
    small.width = 100;
    small.fov_x = 0.1;
    recorder.add(0, wide, 0);
    recorder.add(1, narrow, 0);
    recorder.add(2, small, 0);
    recorder.stop(folder / "zoom.json");
    const std::vector<Camera> read = readCameraFile(folder / "zoom.json");
    REQUIRE(read.size() == 5);
    CHECK(read[1].fov_x == doctest::Approx(1.0));
    CHECK(read[3].fov_x == 0.5);
    CHECK(read[3].width == 1280);
    CHECK(read[4].width == 100);
}

TEST_CASE("what no trajectory can hold is left out or refused")
{
    const TemporaryFolder folder;
    const double nan = std::numeric_limits<double>::quiet_NaN();
    PathRecorder recorder;
    for (const double fps : {0.0, -1.0, nan, 1001.0})
        CHECK(outcomeOf([&] { recorder.start("r", fps); }).code == ErrorCode::Usage);
    recorder.start("r", 30);
    CHECK(outcomeOf([&] { recorder.stop(folder / "none.json"); }).code == ErrorCode::Usage);
    CHECK_FALSE(std::filesystem::exists(folder / "none.json"));
    const Camera good = windowCamera({1, 2, 3});
    CHECK_FALSE(recorder.add(nan, good, 0));
    CHECK(recorder.add(1, good, nan));
    CHECK_FALSE(recorder.add(1, good, 0));
    CHECK_FALSE(recorder.add(0.5, good, 0));
    const auto refuses = [&](const auto& spoil) {
        Camera camera = good;
        spoil(camera);
        return !recorder.add(2, camera, 0);
    };
    CHECK(refuses([&](Camera& c) { c.translation[0] = nan; }));
    CHECK(refuses([&](Camera& c) { c.translation[0] = 1e16; }));
    CHECK(refuses([&](Camera& c) { c.rotation[4] = nan; }));
    CHECK(refuses([&](Camera& c) { std::fill_n(c.rotation, 9, 0.0); }));
    CHECK(refuses([&](Camera& c) { c.fov_x = 0; }));
    CHECK(refuses([&](Camera& c) { c.fov_y = 3.2; }));
    CHECK(refuses([&](Camera& c) { c.width = 0; }));
    CHECK(refuses([&](Camera& c) { c.height = 40000; }));
    Camera off = good;
    off.tan_mid_y = 0.1;
    CHECK(outcomeOf([&] { recorder.add(2, off, 0); }).code == ErrorCode::Unsupported);
    CHECK(recorder.frames() == 1);

    // a scaled world, as transforms files have it, comes down to size
    Camera scaled = good;
    for (double& value : scaled.rotation)
        value /= 100;
    for (double& value : scaled.translation)
        value /= 100;
    CHECK(recorder.add(1 + 1 / 30.0, scaled, 0));
    CHECK(recorder.stop(folder / "r.json") == 2);
    const std::vector<Camera> read = readCameraFile(folder / "r.json");
    CHECK(sameEye(read[0], good));
    CHECK(length(positionOf(read[1]) - glm::dvec3(1, 2, 3)) < 1e-12);

    // a long pause does not fill the memory
    recorder.start("long", 1000);
    recorder.add(0, good, 0);
    CHECK(recorder.add(1e12, good, 0));
    CHECK(recorder.frames() == PathRecorder::kMostFrames);
}

TEST_CASE("a file that is there stays, and the recording waits for another name")
{
    const TemporaryFolder folder;
    const std::string path = folder / "taken.json";
    std::ofstream(path) << "mine";
    PathRecorder recorder;
    recorder.start("r", 30);
    recorder.add(0, windowCamera({1, 2, 3}), 0);
    CHECK(outcomeOf([&] { recorder.stop(path); }).code == ErrorCode::Io);
    CHECK(outcomeOf([&] { recorder.stop(folder / "missing/r.json"); }).code == ErrorCode::Io);
    std::string text;
    std::ifstream(path) >> text;
    CHECK(text == "mine");
    CHECK(recorder.records());
    CHECK(recorder.frames() == 1);
    CHECK(recorder.stop(folder / "free.json") == 1);
    recorder.start("again", 30);
    recorder.add(0, windowCamera({1, 2, 3}), 0);
    CHECK(recorder.stop(path, true) == 1);
    CHECK(readCameraFile(path).size() == 1);
}
