// SPDX-License-Identifier: Apache-2.0
#include "player/frames/made_cameras.h"
#include "player/frames/shots.h"
#include "player/poses/pose.h"
#include "tests/format/tiny_gsc.h"
#include "tests/support/temporary_folder.h"

#include <doctest/doctest.h>

#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <glm/matrix.hpp>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <numbers>

using namespace gsc;
using glm::dvec3;
using Place = std::array<double, 3>;

namespace {

constexpr Place kUp = {0, -1, 0};

Camera lensOf(double fov = 1.2)
{
    Camera camera;
    camera.fov_x = fov;
    camera.fov_y = 0.9;
    camera.width = 64;
    camera.height = 48;
    return camera;
}

Camera at(const dvec3& position, double yaw, double pitch, double roll)
{
    Camera camera = lensOf();
    const glm::dquat turn = glm::angleAxis(yaw, dvec3(0, 1, 0)) * glm::angleAxis(pitch, dvec3(1, 0, 0)) *
                            glm::angleAxis(roll, dvec3(0, 0, 1));
    setPose({position, glm::mat3_cast(turn)}, camera);
    return camera;
}

CameraPose pose(const Camera& camera)
{
    return poseOf(camera).value();
}

bool samePose(const Camera& a, const Camera& b)
{
    return std::memcmp(a.rotation, b.rotation, sizeof(a.rotation)) == 0 &&
           std::memcmp(a.translation, b.translation, sizeof(a.translation)) == 0;
}

double apart(const Camera& a, const Camera& b)
{
    return distance(pose(a).position, pose(b).position);
}

std::vector<Camera> ring(const dvec3& target, double radius, double height, int count, double first, double step)
{
    std::vector<Camera> cameras;
    for (int i = 0; i < count; ++i) {
        const double angle = first + step * i;
        const dvec3 p = target + dvec3(radius * std::cos(angle), -height, radius * std::sin(angle));
        cameras.push_back(cameraAt({{p.x, p.y, p.z}, {target.x, target.y, target.z}}, kUp, lensOf()));
    }
    return cameras;
}

} // namespace

TEST_CASE("a camera of one's own is level and has the place in its middle")
{
    const Camera camera = cameraAt({{1, 2, 3}, {4, 1, 7}}, kUp, lensOf());
    const CameraPose found = pose(camera);
    CHECK(distance(found.position, dvec3(1, 2, 3)) < 1e-12);
    CHECK(distance(found.axes[2], normalize(dvec3(3, -1, 4))) < 1e-12);
    CHECK(std::abs(found.axes[0].y) < 1e-12);
    CHECK(found.axes[1].y > 0); // down
    CHECK(determinant(found.axes) == doctest::Approx(1));
    CHECK(camera.fov_x == 1.2);
}

TEST_CASE("a camera that looks straight down or up is held as by a person who looks ahead with the lens")
{
    const Camera lens = at({0, 0, 0}, 0.5, 0, 0); // looks ahead, level
    const dvec3 ahead = pose(lens).axes[2];
    const CameraPose down = pose(cameraAt({{0, 0, 0}, {0, 5, 0}}, kUp, lens));
    CHECK(distance(-down.axes[1], ahead) < 1e-9);
    const CameraPose up = pose(cameraAt({{0, 0, 0}, {0, -5, 0}}, kUp, lens));
    CHECK(distance(-up.axes[1], -ahead) < 1e-9);
    // a lens that looks straight down itself keeps its own upper edge
    const Camera below = at({0, 0, 0}, 0, -std::numbers::pi / 2, 0);
    const CameraPose same = pose(cameraAt({{0, 0, 0}, {0, 5, 0}}, kUp, below));
    CHECK(distance(same.axes[2], pose(below).axes[2]) < 1e-9);
    CHECK(distance(same.axes[1], pose(below).axes[1]) < 1e-9);
    for (const CameraPose& found : {down, up, same})
        CHECK(determinant(found.axes) == doctest::Approx(1));
}

TEST_CASE("places that are too near to tell a direction")
{
    CHECK_FALSE(hasDirection({{1, 2, 3}, {1, 2, 3}}));
    CHECK_FALSE(hasDirection({{1e15, 0, 0}, {1e15, 0.1, 0}}));
    CHECK_FALSE(hasDirection({{0, 0, 0}, {0, 0, 0}}));
    CHECK(hasDirection({{0, 0, 0}, {1e-9, 0, 0}}));
}

TEST_CASE("a turn closes: the frame behind the last would be the first")
{
    const Sight sight = {{4, -2, 1}, {1, 0.5, -1}};
    const std::vector<Camera> turn = turntable(sight, kUp, lensOf(), 16);
    REQUIRE(turn.size() == 16);
    CHECK(samePose(turn[0], cameraAt(sight, kUp, lensOf())));
    const double step = apart(turn[0], turn[1]);
    CHECK(step == doctest::Approx(2 * std::sqrt(13.0) * std::sin(std::numbers::pi / 16)));
    for (size_t i = 0; i < turn.size(); ++i) {
        const CameraPose here = pose(turn[i]);
        CHECK(apart(turn[i], turn[(i + 1) % turn.size()]) == doctest::Approx(step));
        CHECK(here.position.y == doctest::Approx(-2));
        CHECK(distance(here.axes[2], normalize(dvec3(1, 0.5, -1) - here.position)) < 1e-12);
    }
    // one turn, not two, to the left as seen from above: y points down
    CHECK(apart(turn[0], turn[8]) == doctest::Approx(2 * std::sqrt(13.0)));
    const dvec3 first = pose(turn[0]).position - dvec3(1, 0.5, -1), next = pose(turn[1]).position - dvec3(1, 0.5, -1);
    CHECK(dot(cross(first, next), dvec3(0, -1, 0)) > 0);
}

TEST_CASE("a turn goes round what the cameras look at, from their distance and height")
{
    const std::vector<Camera> cameras = ring({1, 2, 3}, 5, 2, 9, 0.7, 0.3);
    const Sight sight = turntableSight(cameras, kUp, {-99, -99, -99}, {0, 0, 0});
    for (int i = 0; i < 3; ++i) {
        CHECK(sight.target[size_t(i)] == doctest::Approx(Place{1, 2, 3}[size_t(i)]));
        CHECK(sight.position[size_t(i)] == doctest::Approx(pose(cameras[0]).position[i]));
    }
    CHECK(widestGap(cameras, sight, kUp) == doctest::Approx(2 * std::numbers::pi - 8 * 0.3));
    // from above no steeper than 60 degrees
    const std::vector<Camera> above = ring({1, 2, 3}, 0.5, 8, 7, 0, 1);
    const Sight steep = turntableSight(above, kUp, {-99, -99, -99}, {0, 0, 0});
    CHECK(std::hypot(steep.position[0] - 1, steep.position[2] - 3) ==
          doctest::Approx(8 / std::tan(std::numbers::pi / 3)));
    CHECK(steep.position[1] == doctest::Approx(2 - 8));
}

TEST_CASE("a turn without cameras that agree goes round the middle of the model")
{
    const std::vector<Camera> parallel = {at({0, 0, 0}, 0, 0, 0), at({1, 0, 0}, 0, 0, 0)};
    std::vector<Camera> outward = ring({0, 0, 0}, 5, 0, 8, 0, std::numbers::pi / 4);
    for (Camera& camera : outward) { // all look away from the middle
        CameraPose turned = pose(camera);
        turned.axes = glm::dmat3(-turned.axes[0], turned.axes[1], -turned.axes[2]);
        setPose(turned, camera);
    }
    for (const std::vector<Camera>& cameras : {std::vector<Camera>{}, parallel, outward}) {
        const Sight sight = turntableSight(cameras, kUp, {-2, -4, -6}, {4, 4, 4});
        CHECK(sight.target == Place{1, 0, -1});
        const double away = std::sqrt(36 + 64 + 100.0);
        CHECK(sight.position[1] == doctest::Approx(-away / 2)); // 30 degrees above
        CHECK(std::hypot(sight.position[0] - 1, sight.position[1], sight.position[2] + 1) == doctest::Approx(away));
    }
}

TEST_CASE("a turn without cameras that agree is as near as what is not far away lets it")
{
    const test::TemporaryFolder folder;
    test::TinyGscOptions options;
    options.anchors = 12000;
    options.cameras = 1;
    std::vector<std::byte> bytes = test::tinyGsc(options);
    CameraChoice choice;
    choice.motion = CameraMotion::Turntable;
    Reporter log({ReportFormat::Text, ProgressMode::None, true});
    const auto away = [&](const std::string& file) {
        std::ofstream(file, std::ios::binary)
            .write(reinterpret_cast<const char*>(bytes.data()), std::streamsize(bytes.size()));
        const std::vector<Shot> shots = chooseShots(*Scene::open(file), file, choice, {}, log);
        return distance(pose(shots[0].camera).position, pose(shots[shots.size() / 2].camera).position);
    };
    const double near = away(folder / "near.gsc");
    auto* const params = test::records<ModelParams>(bytes, kSectionParams);
    REQUIRE(params->group_count > 40);
    for (float* high : {params->bounds_max, test::records<LevelRecord>(bytes, kSectionLevels)->bounds_max,
                        test::records<ChunkRecord>(bytes, kSectionChunks)->anchor_max,
                        test::records<GroupRecord>(bytes, kSectionGroups)->anchor_max})
        high[0] = 1000; // one group reaches far
    test::reseal(bytes);
    const double far = away(folder / "far.gsc");
    CHECK(near > 1);
    CHECK(far == doctest::Approx(near).epsilon(0.1));
}

TEST_CASE("a way passes through its cameras, evenly and without a corner")
{
    std::vector<Camera> keys = {at({0, 0, 0}, 0, 0, 0), at({3, 0, 1}, 0.4, 0.1, 0.2),
                                at({3.5, -1, 1.5}, 0.9, 0.3, -0.1), at({2, -2, 6}, 2.5, -0.4, 0),
                                at({2, -2, 9}, 3.8, 0, 0.3)};
    keys[2].fov_x = 0.8;
    const size_t frames = 2001;
    const std::vector<Camera> way = wayThrough(keys, frames);
    REQUIRE(way.size() == frames);
    CHECK(samePose(way.front(), keys.front()));
    CHECK(samePose(way.back(), keys.back()));
    double length = 0, longest = 0, sharpest = 0;
    for (size_t i = 1; i < frames; ++i) {
        length += apart(way[i - 1], way[i]);
        longest = std::max(longest, apart(way[i - 1], way[i]));
        if (i + 1 < frames)
            sharpest = std::max(
                sharpest, distance(pose(way[i + 1]).position + pose(way[i - 1]).position, 2.0 * pose(way[i]).position));
        CHECK(determinant(pose(way[i]).axes) == doctest::Approx(1));
    }
    const double step = length / double(frames - 1);
    CHECK(longest < 3 * step);
    CHECK(sharpest < 0.1 * step); // at a corner it is about a step
    for (const Camera& key : keys) {
        const auto nearest = std::ranges::min_element(way, {}, [&](const Camera& c) { return apart(c, key); });
        CHECK(apart(*nearest, key) < longest);
        CHECK(distance(pose(*nearest).axes[2], pose(key).axes[2]) < 0.01);
        CHECK(distance(pose(*nearest).axes[0], pose(key).axes[0]) < 0.01);
        CHECK(nearest->fov_x == doctest::Approx(key.fov_x).epsilon(0.01));
    }
}

TEST_CASE("a way along even cameras has a frame at each, and the same one twice does not stop it")
{
    std::vector<Camera> keys;
    for (int i = 0; i < 5; ++i)
        keys.push_back(at({double(i), 0.5 * i, 0}, 0.1 * i, 0, 0));
    const std::vector<Camera> way = wayThrough(keys, 41);
    for (size_t i = 0; i < keys.size(); ++i) {
        CHECK(apart(way[10 * i], keys[i]) < 1e-9);
        CHECK(distance(pose(way[10 * i]).axes[2], pose(keys[i]).axes[2]) < 1e-9);
    }
    const std::vector<Camera> two = wayThrough(std::vector<Camera>{keys[0], keys[0], keys[1]}, 31);
    for (const Camera& camera : two)
        CHECK(isFinite(pose(camera)));
    CHECK(apart(two.back(), keys[1]) == 0);
    const std::vector<Camera> still = wayThrough(std::vector<Camera>{keys[0], keys[0]}, 2);
    CHECK(samePose(still[1], keys[0]));
}

TEST_CASE("a turn the longer way round in numbers is the shorter one on the way")
{
    Camera a = at({0, 0, 0}, 3.1, 0, 0), b = at({1, 0, 0}, -3.1, 0, 0);
    const std::vector<Camera> way = wayThrough(std::vector<Camera>{a, b}, 11);
    for (const Camera& camera : way)
        CHECK(pose(camera).axes[2].z < -0.99);
}

TEST_CASE("cameras in the order of their names")
{
    std::vector<Camera> cameras;
    for (const char* name : {"img_10", "img_9", "img_009b", "b", "IMG", "img_", "", "img_10_2", "img_10_10"}) {
        cameras.push_back(lensOf());
        cameras.back().name = name;
    }
    sortByName(cameras);
    std::vector<std::string> names;
    for (const Camera& camera : cameras)
        names.push_back(camera.name);
    CHECK(names ==
          std::vector<std::string>{"", "IMG", "b", "img_", "img_9", "img_009b", "img_10", "img_10_2", "img_10_10"});
}

TEST_CASE("all cameras of a file say where up is, whichever are chosen")
{
    const test::TemporaryFolder folder;
    const std::vector<std::byte> bytes = test::tinyGsc({});
    std::ofstream(folder / "a.gsc", std::ios::binary)
        .write(reinterpret_cast<const char*>(bytes.data()), std::streamsize(bytes.size()));
    std::ofstream path(folder / "path.json");
    path << R"({"schema": "gsc.trajectory/1", "frames": [)";
    for (int i = 0; i < 4; ++i) { // all look down, towards the middle between them
        const double c = std::cos(0.8), s = std::sin(0.8), yaw = std::numbers::pi / 2 * i;
        const double f[2] = {std::sin(yaw), std::cos(yaw)};
        path << (i > 0 ? "," : "")
             << formatString(R"({"position": [0, 0, 0], "fov_x": 1, "width": 8, "height": 8,
                                "rotation": [[%.9f, %.9f, %.9f], [0, %.9f, %.9f], [%.9f, %.9f, %.9f]]})",
                             f[1], -s * f[0], c * f[0], c, s, -f[0], -s * f[1], c * f[1]);
    }
    path << "]}";
    path.close();
    const auto scene = Scene::open(folder / "a.gsc");
    Reporter log({ReportFormat::Text, ProgressMode::None, true});
    CameraChoice choice;
    choice.file = folder / "path.json";
    choice.first = 2;
    choice.end = 3;
    const auto isUp = [&](const CameraChoice& chosen) {
        const std::vector<Shot> shots = chooseShots(*scene, folder / "a.gsc", chosen, {}, log);
        REQUIRE(shots.size() == 1);
        return distance(dvec3(shots[0].up[0], shots[0].up[1], shots[0].up[2]), dvec3(0, -1, 0)) < 1e-6;
    };
    CHECK(isUp(choice));
    choice.position = {1, 2, 3};
    choice.look_at = {1, 9, 4};
    CHECK(isUp(choice));
}
