// SPDX-License-Identifier: Apache-2.0
// The paths beside every model: what the player reads, and that each moves as it says.
#include "convert/input/checkpoint.h"
#include "convert/sample/paths/site_paths.h"
#include "convert/survey/model_survey.h"
#include "runtime/cameras/camera_file.h"
#include "sample/live_motion.h"
#include "sample/sample_tools.h"

#include <doctest/doctest.h>

#include <cmath>
#include <map>

using namespace gsc;
using namespace gsc::test;

namespace {

constexpr double kPi = 3.14159265358979323846;

struct Poses {
    std::vector<dvec3> position, forward;
    double ipd = 0;

    [[nodiscard]] size_t size() const { return position.size(); }
    [[nodiscard]] double step(size_t i) const { return length(position[i] - position[i - 1]); }
    [[nodiscard]] double turn(size_t i) const // radians
    {
        return std::atan2(length(cross(forward[i], forward[i - 1])), dot(forward[i], forward[i - 1]));
    }
};

Poses readPoses(const std::string& path)
{
    CAPTURE(path);
    Poses poses;
    TrajectoryFacts eyes;
    const std::vector<Camera> cameras = readCameraFile(path, &eyes);
    poses.ipd = eyes.ipd;
    CHECK(poses.ipd > 0);
    size_t wrong = 0;
    for (const Camera& c : cameras) {
        wrong += c.width != 2048 || c.height != 2048 || !(std::abs(c.fov_x - 0.5 * kPi) < 1e-12);
        const double* r = c.rotation;
        const dvec3 right{r[0], r[3], r[6]}, down{r[1], r[4], r[7]}, forward{r[2], r[5], r[8]};
        const dvec3 lack = cross(right, down) - forward; // zero for a rotation; NaN fails every comparison
        wrong += !(length(lack) < 1e-12) || !(std::abs(length(right) - 1) < 1e-12) ||
                 !(std::abs(length(down) - 1) < 1e-12) || !(std::abs(dot(right, down)) < 1e-12);
        const double* t = c.translation;
        const dvec3 position = dvec3{} - right * t[0] - down * t[1] - forward * t[2];
        wrong += !std::isfinite(length(position));
        poses.position.push_back(position);
        poses.forward.push_back(forward);
    }
    CHECK(wrong == 0);
    return poses;
}

std::map<std::string, Poses> readPaths(const std::string& model)
{
    std::map<std::string, Poses> paths;
    for (const auto& entry : std::filesystem::directory_iterator(model + "/paths"))
        paths[entry.path().stem().string()] = readPoses(entry.path().string());
    return paths;
}

// Every frame of `orbit` looks at one point from one distance: returns the two.
dvec3 checkOrbit(const Poses& orbit, double& distance)
{
    distance = length(orbit.position[0] - orbit.position[60]) / length(orbit.forward[0] - orbit.forward[60]);
    const dvec3 target = orbit.position[0] + orbit.forward[0] * distance;
    size_t wrong = 0;
    for (size_t i = 0; i < orbit.size(); ++i) {
        wrong += !(std::abs(length(orbit.position[i] - target) - distance) < 1e-9 * distance);
        wrong += !(length(orbit.position[i] + orbit.forward[i] * distance - target) < 1e-9 * distance);
        // a degree round the upright, seen from 35 degrees above
        wrong += i && !(std::abs(orbit.step(i) - distance * std::cos(35 * kPi / 180) * 2 * std::sin(kPi / 360)) <
                        1e-9 * distance);
    }
    CHECK(wrong == 0);
    return target;
}

void checkStill(const Poses& head, const Poses& jumps)
{
    double turned = 0;
    size_t turning = 0;
    for (size_t i = 1; i < head.size(); ++i) {
        CHECK(head.step(i) < 1e-9);
        CHECK(head.turn(i) < 5.001 * kPi / 180);
        turned += head.turn(i);
        turning += head.turn(i) > 1e-9;
    }
    CHECK(turned == doctest::Approx(kPi).epsilon(1e-9));
    CHECK(turning == 36); // half a second at 72 frames per second
    CHECK(dot(head.forward.front(), head.forward.back()) == doctest::Approx(-1));

    std::vector<size_t> at;
    for (size_t i = 1; i < jumps.size(); ++i) {
        if (jumps.step(i) > 10 * jumps.ipd)
            at.push_back(i);
        else
            CHECK(jumps.step(i) + jumps.turn(i) == 0);
    }
    CHECK(at == std::vector<size_t>{10, 20, 30, 40, 50, 60, 70});
}

void checkMoving(std::map<std::string, Poses>& paths)
{
    const Poses &flight = paths["aerial"], &walk = paths["walk_through"], &shake = paths["jitter"];
    CHECK(flight.size() == 40);
    for (const Poses* straight : {&flight, &walk})
        for (size_t i = 1; i < straight->size(); ++i) {
            CHECK(straight->turn(i) < 1e-9);
            CHECK(straight->step(i) == doctest::Approx(straight->step(1)).epsilon(1e-6));
        }
    const dvec3 way = walk.position.back() - walk.position.front();
    CHECK(dot(normalized(way), walk.forward[0]) == doctest::Approx(1));
    CHECK(length(way) > 20 * walk.ipd); // 1.3 metres
    CHECK(length(way) < 500 * walk.ipd);

    double least = 1e300, most = 0, metre = shake.ipd / kEyesApart;
    for (size_t i = 1; i < shake.size(); ++i) {
        least = std::min(least, shake.step(i) / metre);
        most = std::max(most, shake.step(i) / metre);
    }
    CHECK(least > 1e-4);
    CHECK(least < 2e-3);
    CHECK(most > 0.01);
    CHECK(most < 0.08);
    CHECK(paths["wide_eyes"].ipd == doctest::Approx(20 * walk.ipd).epsilon(1e-12));
}

void checkDistances(std::map<std::string, Poses>& paths, double standard_dist, bool floor)
{
    double distance = 0;
    const dvec3 target = checkOrbit(paths["orbit"], distance);
    const Poses &zoom = paths["zoom_out"], &swing = paths["level_swing"], &shake = paths["jitter"];
    const auto away = [&](const Poses& path, size_t i) { return length(path.position[i] - target); };
    const double factor = away(zoom, 1) / away(zoom, 0);
    CHECK(factor > 1.01);
    CHECK(factor < 1.1);
    CHECK(away(zoom, 99) >= 3.99 * distance);
    for (size_t i = 1; i < zoom.size(); ++i)
        CHECK(away(zoom, i) / away(zoom, i - 1) == doctest::Approx(factor).epsilon(1e-9));
    for (size_t i = 0; i < shake.size(); ++i)
        CHECK(away(shake, i) == doctest::Approx(0.7 * shake.ipd / kEyesApart).epsilon(0.06));

    // level of an anchor at the target, as upstream computes it; a Scaffold model swings about the orbit's distance
    size_t crossings = 0;
    double last = 0;
    for (size_t i = 0; i < swing.size(); ++i) {
        const double d = away(swing, i), pred = std::log2((standard_dist > 0 ? standard_dist : distance) / d);
        const double level = standard_dist > 0 && !floor ? std::nearbyint(pred) : std::floor(pred);
        crossings += i && level != last;
        last = level;
        if (i)
            CHECK(swing.step(i) < 0.03 * d);
    }
    CHECK(crossings == 7);
}

void checkLive(const std::string& model, std::map<std::string, Poses>& paths)
{
    const double metre = paths["stroll"].ipd / kEyesApart;
    const auto motion = [&](const char* name) {
        REQUIRE(paths.count(name) == 1);
        CHECK(readText(model + "/paths/" + name + ".json").find("\"fps\": 90.0,") != std::string::npos);
        return LiveMotion(paths[name].position, paths[name].forward, metre);
    };
    motion("flight").checkFlight();
    motion("stroll").checkStroll(75.001);
    motion("look_around").checkLookAround();
    // the curve of aerial: from its first place on its line, and to its last place but where that is too far
    const Poses &aerial = paths["aerial"], &flight = paths["flight"];
    const dvec3 way = aerial.position.back() - aerial.position.front();
    const dvec3 flown = flight.position.back() - flight.position.front();
    CHECK(length(flight.position.front() - aerial.position.front()) < 1e-9 * length(way));
    CHECK(length(flight.forward.front() - aerial.forward.front()) < 1e-9);
    CHECK(length(cross(flown, normalized(way))) < 1e-9 * length(way));
    CHECK(length(flown) <= length(way) * (1 + 1e-9));
    CHECK((length(flown) > length(way) - 2 * flight.step(1) || flight.size() == 1800));
}

void checkPaths(const std::string& model)
{
    CAPTURE(model);
    std::map<std::string, Poses> paths = readPaths(model);
    REQUIRE(paths.size() == 12);
    for (const char* name : {"aerial", "orbit", "head_turn", "teleport", "zoom_out", "walk_through", "level_swing",
                             "jitter", "wide_eyes"}) {
        REQUIRE(paths.count(name) == 1);
        CHECK(paths[name].size() >= 40);
        CHECK(paths[name].size() <= 120);
    }
    checkLive(model, paths);
    checkStill(paths["head_turn"], paths["teleport"]);
    checkMoving(paths);
    const Checkpoint checkpoint = readCheckpoint(model, {});
    const bool octree = checkpoint.family == ModelFamily::OctreeGs;
    checkDistances(paths, octree ? double(checkpoint.standard_dist) : 0, checkpoint.level_rule == LevelRule::Floor);
}

// Anchors within `reach` of the way of `path`.
size_t anchorsAlong(const std::string& model, const Poses& path, double reach)
{
    const PlyRows ply = readPlyRows(plyOf(model));
    const dvec3 from = path.position.front(), way = path.position.back() - from;
    size_t count = 0;
    for (size_t i = 0; i < ply.count(); ++i) {
        const dvec3 p = dvec3{ply.at(i, 0), ply.at(i, 1), ply.at(i, 2)} - from;
        const double t = std::clamp(dot(p, way) / dot(way, way), 0.0, 1.0);
        count += length(p - way * t) < reach;
    }
    return count;
}

} // namespace

TEST_CASE("camera paths: beside every sample, the same bytes twice")
{
    const TemporaryFolder scratch;
    for (const SampleScene scene : {SampleScene::City, SampleScene::Street, SampleScene::Room})
        for (const bool octree : {false, true}) {
            SampleOptions options =
                sampleOptions(scene, octree ? SampleModel::Octree : SampleModel::Scaffold, 6000,
                              scratch / ("m" + std::to_string(int(scene)) + std::to_string(octree)));
            options.everything_on = octree && scene == SampleScene::Street; // the level rule is floor
            const SampleReport report = makeSample(options, {});
            CHECK(report.path_file == options.output + "/paths/aerial.json");
            checkPaths(options.output);
            const auto first = hashFolder(options.output + "/paths");
            options.overwrite = true;
            makeSample(options, {});
            CHECK(hashFolder(options.output + "/paths") == first);
        }
}

TEST_CASE("camera paths: beside a city of tiles, in its own units")
{
    const TemporaryFolder scratch;
    for (const SampleModel model : {SampleModel::Scaffold, SampleModel::Octree}) {
        const std::string name = std::to_string(int(model));
        makeSample(sampleOptions(SampleScene::City, model, 30'000, scratch / ("from" + name)), {});
        ReplicateOptions options;
        options.input = scratch / ("from" + name);
        options.output = scratch / ("to" + name);
        options.anchors = 90'000;
        CHECK(replicateCheckpoint(options, {}).path_file == options.output + "/paths/aerial.json");
        checkPaths(options.output);
        const auto first = hashFolder(options.output);
        options.overwrite = true;
        replicateCheckpoint(options, {});
        CHECK(hashFolder(options.output) == first);
        // it passes anchors closer than their Gaussians are large
        const Poses walk = readPoses(options.output + "/paths/walk_through.json");
        CHECK(anchorsAlong(options.output, walk, 1.5) >= 5); // metres: so sparse a city has Gaussians that large
    }
}

TEST_CASE("camera paths: where a level gives way to the next")
{
    PathSite site;
    site.standard_dist = 100;
    CHECK(levelBoundary(site, 42) == 42); // no levels
    site.finest_level = 3;
    site.level_rule = LevelRule::Round;
    for (int k = 0; k < 3; ++k)
        CHECK(levelBoundary(site, 100 * std::exp2(-k - 0.4)) == doctest::Approx(100 * std::exp2(-k - 0.5)));
    CHECK(levelBoundary(site, 1e6) == doctest::Approx(100 * std::exp2(-0.5)));
    CHECK(levelBoundary(site, 1e-6) == doctest::Approx(100 * std::exp2(-2.5)));
    site.level_rule = LevelRule::Floor;
    CHECK(levelBoundary(site, 1e6) == doctest::Approx(50));
    CHECK(levelBoundary(site, 1e-6) == doctest::Approx(12.5));
    for (const LevelRule rule : {LevelRule::Ceil, LevelRule::Progressive}) {
        site.level_rule = rule;
        CHECK(levelBoundary(site, 1e6) == doctest::Approx(100));
        CHECK(levelBoundary(site, 1e-6) == doctest::Approx(25));
    }
    site.fork = 4;
    CHECK(levelBoundary(site, 1e-6) == doctest::Approx(6.25));
}

TEST_CASE("model survey: a camera is as far as what lies in the middle half of its picture, not at its edges")
{
    ModelParams params{};
    CameraRecord camera{}; // looks along z, 90 degrees wide and high
    camera.rotation[0] = camera.rotation[4] = camera.rotation[8] = 1;
    camera.width = camera.height = 100;
    camera.fx = camera.fy = 50;
    GscView view;
    view.params = &params;
    view.cameras = {&camera, 1};
    std::vector<dvec3> points;
    for (int i = -10; i <= 10; ++i) {
        points.emplace_back(0.19 * i, 0.1 * (i % 3), 4); // up to 0.475 of the way to the edge
        for (const double side : {-1.0, 1.0})
            points.emplace_back(8 * 0.55 * side, 0.1 * i, 8); // more of them
    }
    CHECK(surveyPoints(view, points, "m").distances == std::vector<double>{4});
}
