// SPDX-License-Identifier: Apache-2.0
// A bake that was stopped goes on: its file is that of one that never stopped, and nothing that was kept is drawn again.
#include "convert/bake/bake.h"
#include "convert/bake/state/bake_state.h"
#include <gsc/error.h>
#include "tests/bake/made_up_model.h"
#include "tests/support/outcome.h"

#include <doctest/doctest.h>

#include <filesystem>
#include <functional>
#include <optional>

using namespace gsc;
using namespace gsc::test;

namespace {

// Progress that stops what it is told of when it is told for the n-th time.
BakeProgress stopAt(size_t n)
{
    return [n, told = size_t(0)](const char*, uint64_t done, uint64_t total) mutable {
        CHECK(done <= total);
        if (++told == n)
            throw Error(ErrorCode::Interrupted, "bake", "stopped", "the end", "go on");
    };
}

BakeOptions optionsOf(const MadeUpModel& model, const char* output)
{
    BakeOptions options = model.options(output);
    options.target_psnr = 40;
    options.min_view_psnr = 25;
    options.resume_seconds = 0; // kept after every pose
    return options;
}

} // namespace

TEST_CASE("a bake that is stopped again and again comes to the same file, and draws nothing of what was kept again")
{
    for (const SampleModel kind : {SampleModel::Scaffold, SampleModel::Octree}) {
        CAPTURE(int(kind));
        const MadeUpModel model(SampleScene::Street, kind);
        BakeOptions options = optionsOf(model, "never_stopped.gsc");
        const BakeReport never = bake(options, {});
        CHECK(never.pictures_kept == 0);
        const std::string expected = readText(options.output);

        options.output = model.folder / "stopped.gsc";
        options.resume = model.folder / "state";
        std::optional<BakeReport> report;
        size_t stops = 0;
        const size_t before = model.folder.names().size();
        for (size_t pictures = 3; !report && stops < 40; pictures += 3) {
            const auto work = [&] { report = bake(options, stopAt(pictures)); };
            if (outcomeOf(work).code == ErrorCode::Ok)
                break;
            ++stops;
            CHECK(model.folder.names().size() == before + 1); // the state alone
        }
        REQUIRE(report);
        CHECK(stops >= 4); // in the middle of the weights, between them and the search, in it
        CHECK(readText(options.output) == expected);
        CHECK(!std::filesystem::exists(options.resume));
        CHECK(report->pictures_kept >= report->weight_poses + report->search.poses.size());
        CHECK(report->pictures_kept + report->pictures_drawn == never.pictures_drawn);
        CHECK(report->probes == never.probes);
        CHECK(report->search.mse == never.search.mse);
        CHECK(report->search.worstPose().name == never.search.worstPose().name);
        CHECK(report->verdict.mse == never.verdict.mse);
        CHECK(leverShares(*report) == leverShares(never));
    }
}

TEST_CASE("a bake that was stopped while it wrote draws nothing again, on any number of threads")
{
    const MadeUpModel model;
    BakeOptions options = optionsOf(model, "never_stopped.gsc");
    const BakeReport never = bake(options, {});
    const std::string expected = readText(options.output);
    options.output = model.folder / "stopped.gsc";
    options.resume = model.folder / "state";
    options.max_bytes = 1; // is found out when all is written
    CHECK(outcomeOf([&] { (void)bake(options, {}); }).code == ErrorCode::Difference);
    CHECK(std::filesystem::exists(options.resume));
    options.max_bytes = 0;
    options.threads = 1;
    const BakeReport report = bake(options, {});
    CHECK(report.pictures_drawn == 0);
    CHECK(report.pictures_kept == never.pictures_drawn);
    CHECK(readText(options.output) == expected);
    CHECK(!std::filesystem::exists(options.resume));
}

TEST_CASE("a curve that was stopped goes on, and its state stays until it is written")
{
    const MadeUpModel model;
    BakeOptions options = model.options("");
    const std::vector<double> targets{300, 40}; // the first cannot be kept
    const Curve never = bakeCurve(options, targets, model.folder / "scratch.gsc", {});
    options.resume = model.folder / "state";
    const auto work = [&] { (void)bakeCurve(options, targets, model.folder / "scratch.gsc", stopAt(120)); };
    CHECK(outcomeOf(work).code == ErrorCode::Interrupted);
    const Curve curve = bakeCurve(options, targets, model.folder / "scratch.gsc", {});
    CHECK(curve.pictures_kept > options.limits.weights + 20);
    REQUIRE(curve.points.size() == never.points.size());
    CHECK(curve.warnings == never.warnings);
    for (size_t i = 0; i < curve.points.size(); ++i) {
        CHECK(curve.points[i].sizes.archive.file == never.points[i].sizes.archive.file);
        CHECK(curve.points[i].score.accuracy.frame_psnr == never.points[i].score.accuracy.frame_psnr);
        CHECK(curve.points[i].score.accuracy.ssim.mean == never.points[i].score.accuracy.ssim.mean);
    }
    CHECK(std::filesystem::exists(options.resume));
}

TEST_CASE("what another bake has kept is refused, says of what it is and stays")
{
    const MadeUpModel model, other(SampleScene::Street);
    BakeOptions options = optionsOf(model, "baked.gsc");
    options.resume = model.folder / "state";
    REQUIRE(outcomeOf([&] { (void)bake(options, stopAt(14)); }).code == ErrorCode::Interrupted);
    const std::string kept = readText(options.resume);
    const auto refused = [&](const BakeOptions& changed, const std::string& says) {
        CAPTURE(says);
        const Outcome outcome = outcomeOf([&] { (void)bake(changed, {}); });
        CHECK(outcome.code == ErrorCode::InvalidFile);
        CHECK(outcome.says(says));
        CHECK(readText(options.resume) == kept);
        CHECK(!std::filesystem::exists(options.output));
    };
    BakeOptions changed = options;
    changed.target_psnr = 41;
    refused(changed, "is of another bake (target: 40), expected one of the same (target: 41)");
    changed = options;
    changed.min_view_psnr.reset();
    refused(changed, "(worst view: 4 below it)");
    changed = options;
    changed.levers = kLeverSlots | kLeverFeatures;
    refused(changed, "(levers: slots, features)");
    changed = options;
    changed.limits.most_pixels = 10'000;
    refused(changed, "(most pixels: 10000)");
    changed = options;
    changed.limits.verdict = 3;
    refused(changed, "(poses: 12, 4 and 3, ");
    changed = options;
    changed.device = {"cpu-reference"};
    refused(changed, "(drawn by: cpu-reference, ");
    changed = options;
    changed.input = other.whole();
    refused(changed, "(model: ");
    CHECK(outcomeOf([&] {
              (void)bakeCurve(options, {40, 50}, model.folder / "s.gsc", {});
          }).code == ErrorCode::InvalidFile);
    // what changes no measurement may change
    changed = options;
    changed.threads = 1;
    changed.name = "another name";
    CHECK(bake(changed, {}).pictures_kept >= 12);
}
