// SPDX-License-Identifier: Apache-2.0
// The file that a bake goes on from: what is put in comes out, and no byte of it can change unnoticed.
#include "convert/bake/state/bake_state.h"
#include <gsc/error.h>
#include "sample/sample_tools.h"

#include <doctest/doctest.h>

#include <chrono>
#include <cmath>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <thread>

#include <sys/resource.h>

using namespace gsc;
using namespace gsc::test;

namespace {

const std::vector<std::string> kFacts{"program: a test", "target: 50"};
constexpr size_t kMostPoses = 3, kRecord = 80 + 8 * kMostPoses + 8;

Importance importanceOf(uint32_t poses)
{
    Importance i;
    for (int slot = 0; slot < 6; ++slot) {
        i.weight.push_back(float(slot) * 0.1f);
        i.place.push_back(float(slot) * 7);
        i.alive.push_back(uint8_t(slot));
    }
    i.seen = {3, 0, 1};
    i.poses = poses;
    i.places = poses;
    return i;
}

Importance emptyLike(const Importance& of)
{
    Importance i;
    i.weight.resize(of.weight.size());
    i.place.resize(of.place.size());
    i.alive.resize(of.alive.size());
    i.seen.resize(of.seen.size());
    return i;
}

BakePlan planOf(double error)
{
    BakePlan plan;
    plan.error = error;
    return plan;
}

const SetScore kScore{{{"a", 50}, {"b", 40}}, 1e-5, 45, 1}, kEqual{{{"a", INFINITY}}, 0, INFINITY, 0};
const BakeSizes kSizes{100, {1, 2, 3, 4, 5, 6, 7, 80}};

// One of four poses and two scores.
std::string makeState(const std::string& path)
{
    BakeState state(path, kFacts, kMostPoses, 0);
    CHECK(state.poses() == 0);
    state.write(kSizes, importanceOf(4));
    state.add(planOf(0.5), 0, 2, kScore);
    state.add(planOf(0.25), 2, 1, kEqual);
    return readText(path);
}

void put(const std::string& path, const std::string& bytes)
{
    std::ofstream(path, std::ios::binary | std::ios::trunc).write(bytes.data(), std::streamsize(bytes.size()));
}

// Scores that are found there; -1 = the file is refused, and has stayed as it was.
int scoresOf(const std::string& path)
{
    const std::string before = readText(path);
    try {
        BakeState state(path, kFacts, kMostPoses, 0);
        Importance importance = emptyLike(importanceOf(4));
        state.read(importance);
        const Importance expected = importanceOf(4);
        CHECK(importance.weight == expected.weight);
        CHECK(importance.place == expected.place);
        CHECK(importance.seen == expected.seen);
        CHECK(importance.alive == expected.alive);
        CHECK(importance.poses == 4);
        const std::optional<SetScore> one = state.take(planOf(0.5), 0, 2), two = state.take(planOf(0.25), 2, 1);
        if (one) {
            CHECK(one->mse == kScore.mse);
            CHECK(one->worst == 1);
            CHECK(one->poses[1].psnr == 40);
        }
        CHECK((!two || two->poses[0].psnr == INFINITY));
        CHECK(!state.take(planOf(0.5), 0, 2)); // each once
        CHECK(!state.hasScores());
        return int(one.has_value()) + int(two.has_value());
    } catch (const Error& error) {
        CHECK(error.code() == ErrorCode::InvalidFile);
        CHECK(readText(path) == before);
        return -1;
    }
}

} // namespace

TEST_CASE("a bake's state: what is put in comes out")
{
    const TemporaryFolder folder;
    const std::string path = folder / "state";
    const std::string bytes = makeState(path);
    CHECK(scoresOf(path) == 2);
    BakeState state(path, kFacts, kMostPoses, 0);
    CHECK(state.poses() == 4);
    CHECK(state.before().file == 100);
    CHECK(state.before().archive.file == 80);
    CHECK(!state.take(planOf(0.5), 0, 1));
    CHECK(!state.take(planOf(0.5), 1, 2));
    BakePlan other = planOf(0.5);
    other.costs.size *= 2;
    CHECK(!state.take(other, 0, 2));
    // a new importance has no scores yet
    state.write(kSizes, importanceOf(5));
    CHECK(std::filesystem::file_size(path) == bytes.size() - 2 * kRecord);
    CHECK(folder.names().size() == 1);
    std::vector<std::string> warnings;
    removeBakeState(path, warnings);
    removeBakeState(path, warnings);
    removeBakeState("", warnings);
    CHECK(folder.names().size() == 0);
    CHECK(warnings.empty());
}

TEST_CASE("a bake's state: a byte that changed is noticed, one that is missing is a score that was never kept")
{
    const TemporaryFolder folder;
    const std::string path = folder / "state";
    const std::string bytes = makeState(path);
    const size_t records = bytes.size() - 2 * kRecord;
    for (size_t i = 0; i < bytes.size(); ++i) {
        CAPTURE(i);
        std::string changed = bytes;
        changed[i] = char(changed[i] ^ 0x10);
        put(path, changed);
        CHECK(scoresOf(path) == (i < bytes.size() - kRecord ? -1 : 1));
    }
    for (size_t size = 1; size < bytes.size(); ++size) {
        CAPTURE(size);
        put(path, bytes.substr(0, size));
        CHECK(scoresOf(path) == (size < records ? -1 : size < records + kRecord ? 0 : 1));
    }
    // what was cut short goes when the next is added
    put(path, bytes.substr(0, bytes.size() - 5));
    {
        BakeState state(path, kFacts, kMostPoses, 0);
        state.add(planOf(0.25), 2, 1, kEqual);
    }
    CHECK(readText(path) == bytes);
    put(path, bytes.substr(0, bytes.size() - kRecord) + std::string(kRecord, '\0')); // length without its bytes
    {
        BakeState state(path, kFacts, kMostPoses, 0);
        state.add(planOf(0.25), 2, 1, kEqual);
    }
    CHECK(readText(path) == bytes);
    put(path,
        "no state of a bake, but what somebody has written and wants to keep, which is longer than the header of a "
        "state and begins with other bytes than one does");
    CHECK(scoresOf(path) == -1);
}

TEST_CASE("a bake's state: one bake has it at a time")
{
    const TemporaryFolder folder;
    const std::string path = folder / "state";
    const auto isRefused = [](const auto& action) {
        try {
            action();
            return false;
        } catch (const Error& error) {
            CHECK(std::string(error.what()).find("another bake uses it") != std::string::npos);
            return error.code() == ErrorCode::Io;
        }
    };
    const auto open = [&] { const BakeState other(path, kFacts, kMostPoses, 0); };
    {
        BakeState first(path, kFacts, kMostPoses, 0);
        CHECK(isRefused(open)); // though there is nothing in it yet
        CHECK(std::filesystem::file_size(path) == 0);
    }
    CHECK(folder.names().size() == 0);
    put(path, ""); // file of a bake that was killed
    {
        BakeState first(path, kFacts, kMostPoses, 0);
        CHECK(first.poses() == 0);
        first.write(kSizes, importanceOf(4));
        CHECK(isRefused(open));
        first.add(planOf(0.5), 0, 2, kScore);
        first.write(kSizes, importanceOf(4)); // another file, which is its own again
        CHECK(isRefused(open));
        first.add(planOf(0.5), 0, 2, kScore);
        const std::string bytes = readText(path);
        std::filesystem::remove(path);
        put(path, bytes); // somebody else's now
        CHECK(isRefused([&] { first.add(planOf(0.25), 2, 1, kEqual); }));
        CHECK(readText(path) == bytes);
    }
    CHECK(scoresOf(path) == 1);
    checkBakeState(path);
    checkBakeState(folder / "none");
    put(path, "precious");
    CHECK_THROWS_AS(checkBakeState(path), Error);
}

TEST_CASE("a bake's state: on a full disk it stays as it was")
{
    const TemporaryFolder folder;
    const std::string path = folder / "state";
    const std::string bytes = makeState(path);
    struct rlimit before {};
    REQUIRE(::getrlimit(RLIMIT_FSIZE, &before) == 0);
    const auto was = std::signal(SIGXFSZ, SIG_IGN);
    for (const size_t room : {0ul, 50ul}) {
        BakeState state(path, kFacts, kMostPoses, 0);
        const rlimit limit{bytes.size() + room, before.rlim_max};
        REQUIRE(::setrlimit(RLIMIT_FSIZE, &limit) == 0);
        CHECK_THROWS_AS(state.add(planOf(1), 0, 2, kScore), Error);
        REQUIRE(::setrlimit(RLIMIT_FSIZE, &before) == 0);
        CHECK(readText(path) == bytes);
    }
    BakeState state(path, kFacts, kMostPoses, 0);
    const rlimit limit{bytes.size() - 2 * kRecord - 1, before.rlim_max};
    REQUIRE(::setrlimit(RLIMIT_FSIZE, &limit) == 0);
    CHECK_THROWS_AS(state.write(kSizes, importanceOf(5)), Error);
    REQUIRE(::setrlimit(RLIMIT_FSIZE, &before) == 0);
    std::signal(SIGXFSZ, was);
    CHECK(readText(path) == bytes);
    CHECK(folder.names().size() == 1);
}

TEST_CASE("a bake's state: files of weights are half a minute apart, and lie where a file can be")
{
    const TemporaryFolder folder;
    const Importance importance = importanceOf(1);
    CHECK(BakeState(folder / "state", kFacts, kMostPoses, 0).isDue(importance));
    CHECK(!BakeState(folder / "state", kFacts, kMostPoses, 30).isDue(importance));
    // nor sooner than a hundred times what the last one took
    BakeState state(folder / "state", kFacts, kMostPoses, 1e-9);
    const auto start = std::chrono::steady_clock::now();
    state.write(kSizes, importance);
    const auto cost = std::chrono::steady_clock::now() - start;
    while (!state.isDue(importance))
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
    CHECK(std::chrono::steady_clock::now() - start > 20 * cost);
    CHECK_THROWS_AS(BakeState(folder / "none/state", kFacts, kMostPoses, 0), Error);
    CHECK_THROWS_AS(BakeState("-", kFacts, kMostPoses, 0), Error);
    CHECK_THROWS_AS(BakeState(folder.path().string(), kFacts, kMostPoses, 0), Error);
}
