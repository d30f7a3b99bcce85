// SPDX-License-Identifier: Apache-2.0
// A bake keeps what it promises, the same on any number of threads, and leaves nothing where it cannot.
#include "convert/bake/bake.h"
#include "convert/bake/weights/picture_bands.h"
#include "convert/write/write_gsc.h"
#include "format/archive/archive.h"
#include <gsc/error.h>
#include <gsc/gsc_file.h>
#include "runtime/cameras/trainer_cameras.h"
#include "runtime/records/timed_details.h"
#include <gsc/renderer.h>
#include "sample/sample_tools.h"
#include "tests/bake/made_up_model.h"
#include "tests/bake/opened.h"
#include "tests/support/checkpoints.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <filesystem>
#include <iterator>

using namespace gsc;
using namespace gsc::test;

namespace {

PoseSets posesOf(const Scene& scene, const PoseLimits& limits)
{
    std::vector<Camera> cameras;
    for (const SourceCamera& camera : scene.cameras())
        cameras.push_back(cameraOf(camera));
    return splitPoses(cameras, limits);
}

PictureProbe probeOf(const std::shared_ptr<const Scene>& scene)
{
    std::unique_ptr<Renderer> renderer = makeRenderer({"cpu"}, {2});
    renderer->load(scene);
    return {scene, std::move(renderer), [] {}};
}

} // namespace

TEST_CASE("importance depends neither on threads nor on bands of a picture, and what draws nothing has none")
{
    const MadeUpModel model;
    const std::shared_ptr<const Scene> scene = Scene::open(model.whole());
    const PoseSets poses = posesOf(*scene, model.options("").limits);
    Importance results[3];
    for (int i = 0; i < 3; ++i) {
        PictureProbe probe = probeOf(scene);
        // the last cuts every picture into bands as narrow as can be
        ImportanceMeter meter(scene->view(), i == 0 ? 1 : 3, {}, i == 2 ? 1 : kMostSlotsAtOnce);
        for (const Camera& camera : poses.weights) {
            meter.add(probe.eyeOf(camera), probe.optionsOf(camera));
            meter.lookFrom(probe.eyeOf(camera).center, -1);
        }
        results[i] = std::move(meter).take();
    }
    for (int i = 1; i < 3; ++i) {
        CHECK(results[0].weight == results[i].weight);
        CHECK(results[0].place == results[i].place);
        CHECK(results[0].seen == results[i].seen);
        CHECK(results[0].alive == results[i].alive);
    }
    const uint32_t K = scene->view().params->n_offsets;
    size_t drawn = 0;
    for (size_t slot = 0; slot < results[0].weight.size(); ++slot) {
        drawn += results[0].weight[slot] > 0;
        if (results[0].weight[slot] > 0) { // from where it is alive, and only if its anchor was seen
            CHECK(results[0].alive[slot] > 0);
            CHECK(results[0].seen[slot / K] > 0);
            CHECK(results[0].place[slot] > 0);
        }
    }
    CHECK(drawn * 20 > results[0].weight.size());
}

TEST_CASE("a bake keeps its target, says what it did, and its file shows what was judged")
{
    const MadeUpModel model;
    BakeOptions options = model.options("baked.gsc");
    options.target_psnr = 45;
    const BakeReport report = bake(options, {});
    CHECK(report.search.psnr >= 45);
    CHECK(report.verdict.psnr >= 45);
    CHECK(report.verdict.worstPose().psnr >= 41);
    CHECK(report.after.archive.file * 2 < report.before.archive.file);

    const Opened whole(model.whole()), baked(options.output);
    CHECK(baked.view.header->anchor_count == report.anchors - report.anchors_left_out);
    CHECK(baked.view.header->source_hash == whole.view.header->source_hash);
    CHECK(baked.view.manifest.find("\"reduction\"") != std::string_view::npos);
    CHECK(archiveSize(baked.file, baked.view, 1).file == report.after.archive.file);
    // the pictures of the file are those of the model in memory, to the last bit of their scores
    const std::shared_ptr<const Scene> scene = Scene::open(model.whole()), made = Scene::open(options.output);
    PictureProbe probe = probeOf(scene);
    const PoseSets poses = posesOf(*scene, options.limits);
    probe.addPoses(poses.verdict);
    const SetScore score = probe.score(made->view(), 0, poses.verdict.size());
    CHECK(score.mse == report.verdict.mse);
    // levers: what each took is what the archive lost, but for the index
    int64_t sum = 0;
    for (const int64_t bytes : leverShares(report))
        sum += bytes;
    const auto of_anchors = [](const BakeSizes& sizes) {
        return int64_t(sizes.archive.anchors() + sizes.archive.networks - sizes.archive.other_anchors);
    };
    CHECK(std::abs(sum - (of_anchors(report.before) - of_anchors(report.after))) < 4096);
}

TEST_CASE("a bake gives the same bytes on any number of threads, of every kind of model")
{
    for (const SampleModel kind : {SampleModel::Scaffold, SampleModel::Octree}) {
        CAPTURE(int(kind));
        const MadeUpModel model(SampleScene::Street, kind);
        std::string bytes[2];
        for (int i = 0; i < 2; ++i) {
            BakeOptions options = model.options(i == 0 ? "one.gsc" : "three.gsc", i == 0 ? 1 : 3);
            options.target_psnr = 40;
            options.min_view_psnr = 30;
            (void)bake(options, {});
            bytes[i] = readText(options.output);
        }
        CHECK(bytes[0] == bytes[1]);
    }
}

TEST_CASE("an archive is baked to the bytes that its file is")
{
    const MadeUpModel model;
    BakeOptions options = model.options("of_file.gsc");
    options.target_psnr = 40;
    const BakeReport report = bake(options, {});
    const std::string of_file = readText(options.output);
    {
        const Opened whole(model.whole());
        (void)writeArchive(whole.file.bytes(), whole.view, model.folder / "archive.gsc", false, {},
                           [](uint64_t, uint64_t) {});
    }
    options.input = model.folder / "archive.gsc";
    options.output = model.folder / "of_archive.gsc";
    CHECK(bake(options, {}).before.file == report.before.file);
    CHECK(readText(options.output) == of_file);
}

TEST_CASE("without a target only what never draws goes, and no pose that judged shows it")
{
    const MadeUpModel model;
    const BakeOptions options = model.options("never.gsc");
    const BakeReport report = bake(options, {});
    CHECK(report.slots_masked >= 2 * (report.anchors - report.anchors_left_out));
    const Opened whole(model.whole()), baked(options.output);
    CHECK((baked.view.params->flags & kModelMaskedSlots) != 0);
    const std::shared_ptr<const Scene> scene = Scene::open(model.whole()), made = Scene::open(options.output);
    PictureProbe probe = probeOf(scene);
    const PoseSets poses = posesOf(*scene, options.limits);
    probe.addPoses(poses.weights);
    CHECK(probe.score(made->view(), 0, poses.weights.size()).worstPose().psnr >= 90);
}

TEST_CASE("a compact bake is valid, and stays compact when it is baked again")
{
    for (const SampleModel kind : {SampleModel::Scaffold, SampleModel::Octree}) {
        CAPTURE(int(kind));
        const MadeUpModel model(SampleScene::Street, kind);
        BakeOptions options = model.options("compact.gsc");
        options.levers = kLeverCompact;
        const BakeReport report = bake(options, {});
        CHECK(report.verdict.psnr >= 40); // a made-up scene has steep networks; trained ones keep about 60
        CHECK(leverShares(report)[std::countr_zero(uint32_t(kLeverCompact))] > 0);
        const Opened baked(options.output); // by the validator, which tests every value
        CHECK((baked.view.params->flags & kModelCompact) != 0);
        BakeOptions again = model.options("again.gsc");
        again.input = options.output;
        again.levers = kLeverFeatures | kLeverOffsets;
        again.target_psnr = 40;
        (void)bake(again, {});
        const Opened twice(again.output);
        CHECK((twice.view.params->flags & kModelCompact) != 0);
    }
}

TEST_CASE("levers that are off leave values as they were")
{
    const MadeUpModel model;
    BakeOptions options = model.options("some.gsc");
    options.target_psnr = 40;
    options.levers = kLeverFeatures;
    const BakeReport report = bake(options, {});
    CHECK(report.anchors_left_out == 0);
    CHECK(report.slots_masked == 0);
    const Opened whole(model.whole()), baked(options.output);
    CHECK((baked.view.params->flags & kModelMaskedSlots) == 0);
    CHECK(std::ranges::equal(whole.view.weights, baked.view.weights));
    CHECK(std::ranges::equal(whole.view.index, baked.view.index)); // the order of the checkpoint
    for (size_t c = 0; c < whole.view.chunks.size(); ++c) {
        const ChunkArrayLayout layout = chunkArrayLayout(*whole.view.params, whole.view.chunks[c].anchor_count);
        const auto a = chunkPayload(whole.view, whole.view.chunks[c]),
                   b = chunkPayload(baked.view, baked.view.chunks[c]);
        const size_t features = layout.offset[uint32_t(ChunkArray::Feature)];
        CHECK(std::ranges::equal(a.first(features), b.first(features)));
        CHECK(!std::ranges::equal(a.subspan(features), b.subspan(features)));
    }
}

TEST_CASE("where a target cannot be kept nothing is written")
{
    const MadeUpModel model;
    const auto code = [](const BakeOptions& options) {
        try {
            (void)bake(options, {});
        } catch (const Error& error) {
            CHECK(std::string(error.what()).find("nothing was written") != std::string::npos);
            return error.code();
        }
        return ErrorCode::Ok;
    };
    BakeOptions options = model.options("none.gsc");
    options.target_psnr = 40;
    options.max_bytes = 1000;
    const size_t before = model.folder.names().size();
    CHECK(code(options) == ErrorCode::Difference);
    options.max_bytes = 0;
    options.min_view_psnr = 5000; // no pose is as good as that
    CHECK(code(options) == ErrorCode::Difference);
    CHECK(model.folder.names().size() == before);
}

TEST_CASE("a curve is what bakes one by one are, and a target that cannot be kept is left out of it")
{
    const MadeUpModel model;
    const BakeOptions options = model.options("");
    const Curve curve = bakeCurve(options, {300, 50, 40}, model.folder / "scratch.gsc", {});
    REQUIRE(curve.points.size() == 3); // the model and two
    REQUIRE(curve.warnings.size() == 1);
    CHECK(curve.warnings[0].find("expected 300.00 and 296.00") != std::string::npos);
    const CurvePoint &whole = curve.points[0], &fine = curve.points[1], &coarse = curve.points[2];
    CHECK(!whole.target);
    CHECK(whole.score.accuracy.max_error == 0);
    CHECK(whole.score.accuracy.ssim.mean == doctest::Approx(1));
    CHECK(whole.score.accuracy.flip.mean == 0);
    CHECK(fine.sizes.archive.file < whole.sizes.archive.file);
    CHECK(coarse.sizes.archive.file < fine.sizes.archive.file);
    CHECK(coarse.score.accuracy.psnr_pooled < fine.score.accuracy.psnr_pooled);
    CHECK(coarse.score.accuracy.ssim.mean < fine.score.accuracy.ssim.mean);
    CHECK(coarse.score.accuracy.flip.worst >= coarse.score.accuracy.flip.mean);
    CHECK(timesOf(coarse.score.frames).device.median > 0);
    for (const CurvePoint& point : curve.points) {
        CHECK(point.score.detail_ms.size() == std::size(kTimedDetails));
        CHECK(std::ranges::all_of(point.score.detail_ms, [](double ms) { return ms > 0 && ms < 60'000; }));
    }
    CHECK(coarse.score.resident_bytes > 0);
    CHECK(!std::filesystem::exists(model.folder / "scratch.gsc"));
    BakeOptions alone = model.options("alone.gsc");
    alone.target_psnr = 40;
    const BakeReport report = bake(alone, {});
    CHECK(report.after.archive.file == coarse.sizes.archive.file);
    CHECK(report.verdict.psnr == coarse.score.accuracy.psnr_pooled);
    BakeOptions none = options;
    CHECK_THROWS_AS((void)bakeCurve(none, {300}, model.folder / "scratch.gsc", {}), Error);
}

TEST_CASE("a trained model keeps 45 dB in a fifth of its archive")
{
    for (const std::string& path : trainedModels()) {
        if (!path.ends_with("/fox_scaffold"))
            continue;
        const TemporaryFolder folder;
        WriteOptions convert;
        convert.output = folder / "whole.gsc";
        convert.sensitivity = SensitivityMode::None;
        (void)writeGsc(readCheckpoint(path, {}), convert, {});
        BakeOptions options;
        options.input = options.name = convert.output;
        options.output = folder / "baked.gsc";
        options.target_psnr = 45;
        options.limits.most_pixels = 60'000;
        options.device = {"cpu"};
        const BakeReport report = bake(options, {});
        CHECK(report.verdict.psnr >= 45);
        CHECK(report.verdict.worstPose().psnr >= 41);
        CHECK(report.after.archive.file * 5 < report.before.archive.file + report.before.archive.file / 10);
    }
}

TEST_CASE("bands of a picture are all of its columns, each once")
{
    CHECK(pictureBands(1000, 0).size() == 1);
    CHECK(pictureBands(1000, kMostSlotsAtOnce).front().all());
    CHECK(pictureBands(1000, kMostSlotsAtOnce + 1).size() == 2);
    for (const uint32_t width : {1u, 32u, 33u, 1000u})
        for (const uint64_t slots : {uint64_t(3), uint64_t(7), uint64_t(1) << 40}) {
            CAPTURE(width);
            CAPTURE(slots);
            const std::vector<ColumnRange> bands = pictureBands(width, slots, 1);
            CHECK(bands.size() == std::min<uint64_t>(slots, (width + kColumnStep - 1) / kColumnStep));
            uint32_t at = 0;
            for (const ColumnRange& band : bands) {
                CHECK(band.first == at);
                CHECK((band.all() || (band.first % kColumnStep == 0 && band.end % kColumnStep == 0)));
                at = band.within(width).end;
            }
            CHECK(at == width);
        }
}

TEST_CASE("three sets of poses share none")
{
    std::vector<Camera> cameras(20);
    for (size_t i = 0; i < cameras.size(); ++i) {
        cameras[i].name = std::string(1, char('a' + i));
        cameras[i].translation[0] = -double(i);
        cameras[i].width = 4000;
        cameras[i].height = 3000;
        cameras[i].fov_x = cameras[i].fov_y = 1;
    }
    // cameras of two files that share some: the verdict is not to look from where the weights did
    std::vector<Camera> repeated = cameras;
    repeated.insert(repeated.end(), cameras.begin(), cameras.begin() + 7);
    repeated.back().width = 100;
    leaveOutRepeats(repeated);
    CHECK(repeated.size() == cameras.size());
    CHECK(repeated.back().name == cameras.back().name);
    const PoseSets sets = splitPoses(cameras, PoseLimits{});
    std::vector<double> places;
    for (const auto* set : {&sets.weights, &sets.search, &sets.verdict}) {
        CHECK(!set->empty());
        for (const Camera& camera : *set) {
            places.push_back(camera.translation[0]);
            CHECK(camera.width * camera.height <= 1'001'000);
        }
    }
    std::ranges::sort(places);
    CHECK(std::ranges::adjacent_find(places) == places.end());
    CHECK(sets.weights.size() == 20);
    CHECK(sets.search.size() == 10);
    CHECK(sets.verdict.size() == 9);
    // half a turn of a quarter: an eighth
    Camera a = cameras[0], b = cameras[0];
    const double turned[9] = {0, 0, 1, 0, 1, 0, -1, 0, 0};
    std::copy_n(turned, 9, b.rotation);
    b.translation[0] = 0;
    const Camera half = betweenCameras(a, b, 0.5);
    CHECK(half.rotation[0] == doctest::Approx(std::sqrt(0.5)));
    CHECK(half.rotation[2] == doctest::Approx(std::sqrt(0.5)));
}
