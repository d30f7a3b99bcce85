// SPDX-License-Identifier: Apache-2.0
// `gsc sample paths`: every path moves as its description says, at the pace of the metre it states, and sees the model.
#include "convert/input/checkpoint.h"
#include "convert/sample/paths/make_paths.h"
#include "convert/sample/paths/site_paths.h"
#include "convert/write/write_gsc.h"
#include <gsc/file/mapped_file.h>
#include "runtime/cameras/camera_file.h"
#include "runtime/cameras/length.h"
#include "sample/live_motion.h"
#include "sample/sample_tools.h"
#include "support/checkpoints.h"

#include <doctest/doctest.h>

#include <cmath>
#include <set>

using namespace gsc;
using namespace gsc::test;

namespace {

struct Pose {
    dvec3 position, right, down, forward;
};

struct Frames {
    std::vector<Pose> poses;
    std::vector<int> appearance;
    double ipd = 0, metre = 0, fps = 72;

    [[nodiscard]] size_t size() const { return poses.size(); }
    [[nodiscard]] double speed(size_t i) const // metres per second
    {
        return length(poses[i].position - poses[i - 1].position) * fps / metre;
    }
    [[nodiscard]] double turn(size_t i) const // degrees per second
    {
        const dvec3 a = poses[i].forward, b = poses[i - 1].forward;
        return std::atan2(length(cross(a, b)), dot(a, b)) * fps / degrees(1);
    }
};

Frames readFrames(const std::string& file, double metre)
{
    CAPTURE(file);
    Frames frames;
    frames.metre = metre;
    size_t wrong = 0;
    TrajectoryFacts eyes;
    for (const Camera& c : readCameraFile(file, &eyes)) {
        const double* r = c.rotation;
        const double* t = c.translation;
        Pose pose{{}, {r[0], r[3], r[6]}, {r[1], r[4], r[7]}, {r[2], r[5], r[8]}};
        pose.position = dvec3{} - pose.right * t[0] - pose.down * t[1] - pose.forward * t[2];
        wrong += !(length(cross(pose.right, pose.down) - pose.forward) < 1e-9) ||
                 !(std::abs(length(pose.right) - 1) < 1e-9) || !(std::abs(length(pose.down) - 1) < 1e-9) ||
                 !std::isfinite(length(pose.position));
        frames.poses.push_back(pose);
        frames.appearance.push_back(c.appearance);
    }
    frames.ipd = eyes.ipd;
    CHECK(wrong == 0);
    CHECK(frames.size() >= 2);
    CHECK(frames.ipd > 0);
    return frames;
}

std::vector<dvec3> anchorsOf(const Checkpoint& checkpoint)
{
    std::vector<dvec3> anchors;
    AnchorBatch batch;
    const auto source = openAnchors(checkpoint);
    while (source->next(batch, kAnchorPlacement, 65'536))
        for (size_t i = 0; i < batch.count; ++i)
            anchors.push_back({batch.position[3 * i], batch.position[3 * i + 1], batch.position[3 * i + 2]});
    return anchors;
}

// Share of the anchors in a square image with 90 degrees of view; counted apart from the generator.
double shareInImage(const std::vector<dvec3>& anchors, const Pose& pose)
{
    size_t count = 0;
    for (const dvec3& p : anchors) {
        const dvec3 d = p - pose.position;
        const double depth = dot(d, pose.forward);
        count += depth > 0.2 && std::abs(dot(d, pose.right)) < depth && std::abs(dot(d, pose.down)) < depth;
    }
    return double(count) / double(anchors.size());
}

std::string bakeTo(const Checkpoint& checkpoint, const std::string& file)
{
    WriteOptions options;
    options.output = file;
    (void)writeGsc(checkpoint, options, [](const char*, uint64_t, uint64_t) {});
    return file;
}

struct Made {
    PathsReport report;
    std::map<std::string, Frames> paths;
};

Made make(const std::string& model, const std::string& output, Length ipd = {})
{
    PathsOptions options;
    options.input = model;
    options.output = output;
    options.ipd = ipd;
    Made made{makePaths(options), {}};
    for (const ModelPath& path : made.report.paths) {
        made.paths[path.path.name] = readFrames(output + "/" + path.path.name + ".json", made.report.metre);
        made.paths[path.path.name].fps = path.path.fps;
    }
    CHECK(hashFolder(output).size() == made.report.paths.size());
    return made;
}

// The converter wrote the metre that a survey of the file derives, and the paths were made for it.
void checkMetre(const std::string& model, const PathsReport& report)
{
    const MappedFile file(model);
    GscView view;
    REQUIRE(openGsc(file.bytes(), view, GscCheck::Index, nullptr));
    const std::optional<Metre> stated = metreOfManifest(view.manifest);
    REQUIRE(stated.has_value());
    const ModelSurvey survey = surveyModel(view, model);
    CHECK(stated->units == survey.site.metre);
    CHECK(stated->rule == survey.metre_rule);
    CHECK(report.metre == stated->units);
    CHECK(report.metre_rule == stated->rule);
}

void checkPace(Made& made)
{
    // metres and degrees per second that no two frames exceed
    static const std::map<std::string, std::pair<double, double>> kLimits = {
        {"walk", {1.401, 61}},      {"ascent", {4.001, 90}},      {"orbit", {1e9, 25.01}},
        {"head_turn", {0, 360.01}}, {"jitter", {0.9, 120}},       {"walk_through", {1.401, 0.01}},
        {"zoom_out", {1e9, 0.01}},  {"level_swing", {2.0, 0.01}}, {"wide_eyes", {1.401, 61}},
        {"aerial", {10.01, 0.01}}};
    for (const auto& [name, limit] : kLimits) {
        const auto found = made.paths.find(name);
        if (found == made.paths.end())
            continue;
        CAPTURE(name);
        double speed = 0, turn = 0;
        for (size_t i = 1; i < found->second.size(); ++i) {
            speed = std::max(speed, found->second.speed(i));
            turn = std::max(turn, found->second.turn(i));
        }
        CHECK(speed <= limit.first + 1e-6);
        CHECK(turn <= limit.second);
    }
    const Frames& walk = made.paths["walk"];
    for (size_t i = 1; i < walk.size(); ++i)
        CHECK(walk.speed(i) == doctest::Approx(1.4).epsilon(1e-6));
    CHECK(walk.ipd == doctest::Approx(0.064 * made.report.metre));
    CHECK(made.paths["wide_eyes"].ipd == doctest::Approx(20 * walk.ipd));
    const Frames& jumps = made.paths["teleport"];
    REQUIRE(jumps.size() == 80);
    for (size_t i = 1; i < 80; ++i)
        CHECK((jumps.speed(i) + jumps.turn(i) == 0) == (i % 10 != 0));
}

void checkLive(Made& made)
{
    std::vector<dvec3> position, forward;
    const auto motion = [&](const char* name) {
        CAPTURE(name);
        REQUIRE(made.paths.count(name) == 1);
        CHECK(made.paths[name].fps == 90);
        position.clear(), forward.clear();
        for (const Pose& pose : made.paths[name].poses) {
            position.push_back(pose.position);
            forward.push_back(pose.forward);
        }
        return LiveMotion(position, forward, made.report.metre);
    };
    if (made.paths.count("aerial"))
        motion("flight").checkFlight();
    motion("stroll").checkStroll(75 + 61); // while the walker turns, as in `walk`
    motion("look_around").checkLookAround();
}

void checkShapes(Made& made)
{
    const Frames& head = made.paths["head_turn"];
    REQUIRE(head.size() == 72);
    CHECK(dot(head.poses.front().forward, head.poses.back().forward) == doctest::Approx(-1));
    for (size_t i = 37; i < 72; ++i)
        CHECK(head.turn(i) == 0);
    const Frames& zoom = made.paths["zoom_out"];
    CHECK(zoom.speed(72) / zoom.speed(1) > 1.9); // twice as far a second later
    const Frames& rise = made.paths["ascent"];
    const dvec3 up = normalized(rise.poses.back().position - rise.poses.front().position);
    CHECK(dot(rise.poses.back().forward, up) < dot(rise.poses.front().forward, up)); // looks further down
    const Frames& orbit = made.paths["orbit"];
    double turned = 0;
    for (size_t i = 1; i < orbit.size(); ++i)
        turned += orbit.turn(i);
    CHECK(turned > 50);
    const Frames& shake = made.paths["jitter"];
    double reach = 0;
    for (size_t i = 1; i < shake.size(); ++i)
        reach = std::max(reach, length(shake.poses[i].position - shake.poses[0].position) / shake.metre);
    CHECK(reach > 0.01);
    CHECK(reach < 0.06);
}

// Ordinary paths never lose sight of the model; those that go through it or turn away may.
void checkSight(Made& made, const std::vector<dvec3>& anchors)
{
    for (const char* name : {"walk", "ascent", "orbit", "zoom_out", "jitter", "teleport", "level_swing", "wide_eyes"}) {
        CAPTURE(name);
        const Frames& frames = made.paths[name];
        double least = 1;
        for (size_t i = 0; i < frames.size(); i += 6)
            least = std::min(least, shareInImage(anchors, frames.poses[i]));
        CHECK(least > 0.01);
    }
    if (made.paths.count("aerial"))
        CHECK(shareInImage(anchors, made.paths["aerial"].poses.front()) > 0.01);
}

Made checkModel(const Checkpoint& checkpoint, const TemporaryFolder& scratch, const std::string& name)
{
    CAPTURE(name);
    Made made = make(bakeTo(checkpoint, scratch / (name + ".gsc")), scratch / (name + "_paths"));
    const bool flies = made.report.capture == CaptureKind::Aerial || made.report.capture == CaptureKind::None;
    CHECK(made.paths.size() == (flies ? 14 : 12));
    CHECK(made.paths.count("aerial") == size_t(flies));
    CHECK(made.paths.count("flight") == size_t(flies));
    checkMetre(scratch / (name + ".gsc"), made.report);
    checkPace(made);
    checkLive(made);
    checkShapes(made);
    checkSight(made, anchorsOf(checkpoint));
    return made;
}

} // namespace

TEST_CASE("model paths: samples, whose metre is known")
{
    const TemporaryFolder scratch;
    for (const SampleScene scene : {SampleScene::City, SampleScene::Street, SampleScene::Room})
        for (const bool octree : {false, true}) {
            if (octree && scene == SampleScene::Room)
                continue;
            const std::string name = "m" + std::to_string(int(scene)) + std::to_string(octree);
            makeSample(
                sampleOptions(scene, octree ? SampleModel::Octree : SampleModel::Scaffold, 12'000, scratch / name), {});
            Checkpoint checkpoint = readCheckpoint(scratch / name, {});
            CHECK(checkpoint.metre.units == 1);
            checkpoint.metre = {}; // as a trainer leaves it
            const Made made = checkModel(checkpoint, scratch, name);
            CAPTURE(name);
            CAPTURE(made.report.metre);
            CHECK(made.report.capture == (scene == SampleScene::City ? CaptureKind::Aerial : CaptureKind::Around));
            // the air tells no scale: 20 m of height stand for whatever it was
            CHECK(made.report.metre > 0.75);
            CHECK(made.report.metre < (scene == SampleScene::City ? 4.0 : 1.33));
            for (const ModelPath& path : made.report.paths)
                CHECK(path.path.frames[0].appearance == -1);
        }
}

TEST_CASE("model paths: trained models")
{
    const TemporaryFolder scratch;
    for (const std::string& model : trainedModels()) {
        const std::string name = std::filesystem::path(model).filename().string();
        const Made made = checkModel(readCheckpoint(model, {}), scratch, name);
        const bool aerial = name.find("boruszyn") == 0;
        CHECK(made.report.capture == (aerial ? CaptureKind::Aerial : CaptureKind::Inward));
        CHECK(made.report.cameras >= 20);
    }
}

TEST_CASE("model paths: an appearance row per path, of a camera nearby")
{
    const TemporaryFolder scratch;
    SampleOptions options = sampleOptions(SampleScene::Street, SampleModel::Octree, 6000, scratch / "m");
    options.everything_on = true;
    makeSample(options, {});
    const Checkpoint checkpoint = readCheckpoint(options.output, {});
    Made made = make(bakeTo(checkpoint, scratch / "m.gsc"), scratch / "paths");
    std::set<int> rows;
    for (const auto& [name, frames] : made.paths) {
        CAPTURE(name);
        for (size_t i = 0; i < frames.size(); ++i) {
            const size_t from = name == "teleport" ? i : frames.size() / 2;
            int nearest = -1;
            double least = 1e300;
            for (const SourceCamera& c : checkpoint.cameras) {
                const dvec3 at{c.position[0], c.position[1], c.position[2]};
                if (const double d = length(at - frames.poses[from].position); !c.is_test && d < least) {
                    least = d;
                    nearest = c.appearance;
                }
            }
            REQUIRE(frames.appearance[i] == nearest);
            rows.insert(nearest);
        }
    }
    CHECK(rows.size() > 3);
    CHECK(rows.count(-1) == 0);

    WriteOptions one;
    one.output = scratch / "one.gsc";
    one.appearance = 2;
    (void)writeGsc(checkpoint, one, [](const char*, uint64_t, uint64_t) {});
    for (const auto& [name, frames] : make(one.output, scratch / "one").paths)
        for (const int row : frames.appearance)
            CHECK(row == 2); // the only one the file holds
}

TEST_CASE("model paths: without cameras, or with cameras that see nothing, the bounds serve")
{
    const TemporaryFolder scratch;
    makeSample(sampleOptions(SampleScene::City, SampleModel::Octree, 12'000, scratch / "m"), {});
    Checkpoint checkpoint = readCheckpoint(scratch / "m", {});
    checkpoint.metre = {};
    for (SourceCamera& camera : checkpoint.cameras)
        camera.position[2] += 1e6;
    for (const bool some : {true, false}) {
        if (!some)
            checkpoint.cameras.clear();
        const std::string name = some ? "blind" : "none";
        Made made = make(bakeTo(checkpoint, scratch / (name + ".gsc")), scratch / (name + "_paths"));
        CHECK(made.report.capture == CaptureKind::None);
        CHECK(made.report.cameras == 0);
        CHECK(made.report.metre_rule.find("no cameras") == 0);
        checkMetre(scratch / (name + ".gsc"), made.report);
        CHECK(made.paths.size() == 14);
        checkPace(made);
        checkLive(made);
        checkShapes(made);
    }
}

TEST_CASE("model paths: the same bytes twice; the eyes' distance sets the pace")
{
    const TemporaryFolder scratch;
    makeSample(sampleOptions(SampleScene::Room, SampleModel::Scaffold, 6000, scratch / "m"), {});
    const std::string model = bakeTo(readCheckpoint(scratch / "m", {}), scratch / "m.gsc");
    make(model, scratch / "a");
    make(model, scratch / "b");
    CHECK(hashFolder(scratch / "a") == hashFolder(scratch / "b"));
    Made made = make(model, scratch / "c", {0.032, LengthUnit::World});
    CHECK(made.report.metre == doctest::Approx(0.5));
    CHECK(made.report.metre_rule.find("given") == 0);
    checkPace(made);
    // metres move the eyes, not the metre
    const Made first = make(model, scratch / "d");
    Made wide = make(model, scratch / "e", {0.08, LengthUnit::Metre});
    CHECK(wide.report.metre == first.report.metre);
    CHECK(wide.paths["walk"].ipd == doctest::Approx(0.08 * first.report.metre));
    CHECK(wide.paths["wide_eyes"].ipd == doctest::Approx(20 * wide.paths["walk"].ipd));
}

TEST_CASE("model paths: --fps is that of all of them; --only takes those that move as people do")
{
    const TemporaryFolder scratch;
    makeSample(sampleOptions(SampleScene::City, SampleModel::Scaffold, 6000, scratch / "m"), {});
    PathsOptions options;
    options.input = bakeTo(readCheckpoint(scratch / "m", {}), scratch / "m.gsc");
    options.output = scratch / "paths";
    options.only = {"walk", "flight", "stroll", "look_around"};
    const PathsReport usual = makePaths(options);
    options.fps = 30;
    options.overwrite = true;
    const PathsReport slow = makePaths(options);
    REQUIRE(usual.paths.size() == 4);
    REQUIRE(slow.paths.size() == 4);
    for (size_t i = 0; i < 4; ++i) {
        const CameraPath &a = usual.paths[i].path, &b = slow.paths[i].path;
        CAPTURE(a.name);
        CHECK(a.fps == (a.name == "walk" ? 72 : 90));
        CHECK(b.fps == 30);
        CHECK(double(b.frames.size()) / b.fps == doctest::Approx(double(a.frames.size()) / a.fps).epsilon(0.02));
        CHECK(slow.paths[i].top_speed == doctest::Approx(usual.paths[i].top_speed).epsilon(1e-6));
    }
}
