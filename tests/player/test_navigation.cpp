// SPDX-License-Identifier: Apache-2.0
#include "player/window/navigation.h"
#include "runtime/cameras/world_up.h"
#include "tests/player/window_cameras.h"

#include <doctest/doctest.h>

#include <glm/geometric.hpp>
#include <glm/gtc/type_ptr.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <iterator>
#include <limits>
#include <numbers>
#include <vector>

using namespace gsc;

namespace {

constexpr double kDegree = std::numbers::pi / 180;
constexpr double kNan = std::numeric_limits<double>::quiet_NaN(), kInfinity = std::numeric_limits<double>::infinity();

// 200 units of diagonal, 2 units to a metre; up is COLMAP's, so x is right and z ahead of a camera that is not turned.
NavigationWorld world()
{
    NavigationWorld world;
    world.metre = 2;
    world.low[0] = -100;
    world.high[0] = 100;
    return world;
}

Navigator navigatorAt(const Camera& camera, NavigationMode mode = NavigationMode::Fly)
{
    Navigator navigator(world());
    navigator.setMode(mode);
    navigator.jumpTo(camera);
    navigator.setDistance(10);
    return navigator;
}

NavigationInput picture(double seconds = 0)
{
    NavigationInput input;
    input.seconds = seconds;
    input.height = 1000;
    input.fov_y = 90 * kDegree; // 500 pixels of focal length
    return input;
}

glm::dvec3 vec(const std::array<double, 3>& v)
{
    return {v[0], v[1], v[2]};
}

// Columns of the rotation.
glm::dmat3 axesOf(const Navigator& navigator)
{
    const Camera camera = navigator.camera(windowCamera({0, 0, 0}));
    return transpose(glm::make_mat3(camera.rotation));
}

// Degrees of forward above the plane across up, (0, -1, 0).
double elevation(const Navigator& navigator)
{
    return std::asin(-axesOf(navigator)[2].y) / kDegree;
}

double largest(const glm::dmat3& m)
{
    double most = 0;
    for (int i = 0; i < 9; ++i)
        most = std::max(most, std::abs(m[i / 3][i % 3]));
    return most;
}

// Where a point of the world lies in the picture of 1000 rows and 90 degrees, pixels from its middle.
glm::dvec2 pixelOf(const Navigator& navigator, const glm::dvec3& point)
{
    const glm::dvec3 view = transpose(axesOf(navigator)) * (point - vec(navigator.position()));
    return glm::dvec2(view.x, view.y) / view.z * 500.0;
}

bool isWhole(const Navigator& navigator)
{
    const Camera camera = navigator.camera(windowCamera({0, 0, 0}));
    for (const double value : camera.rotation)
        if (!std::isfinite(value))
            return false;
    for (const double value : camera.translation)
        if (!std::isfinite(value))
            return false;
    return std::isfinite(navigator.distance()) && std::isfinite(navigator.speed()) && hasRotation(camera) &&
           length(vec(navigator.position())) <= 1.0001e6 * 200;
}

} // namespace

TEST_CASE("up of a model: what the cameras turn about, wherever they look")
{
    using Up = std::array<double, 3>;
    for (const double pitch : {0.0, 0.6, 1.4, std::numbers::pi / 2}) { // down; z is up
        std::vector<Camera> cameras;
        for (const double yaw : {0.0, 0.4, 0.8, 3.0, 3.6}) {
            const double c = std::cos(yaw), s = std::sin(yaw), p = std::cos(pitch), q = std::sin(pitch);
            const double columns[3][3] = {{s, -c, 0}, {-q * c, -q * s, -p}, {p * c, p * s, -q}};
            Camera& camera = cameras.emplace_back();
            for (int i = 0; i < 9; ++i)
                camera.rotation[i] = columns[i % 3][i / 3];
        }
        const Up up = worldUp(cameras);
        CHECK(up[2] == doctest::Approx(1));
        CHECK(std::hypot(up[0], up[1]) < 1e-12);
    }
    std::vector<Camera> ahead; // cameras that tilt sideways: only their mean is upright
    for (const double roll : {-0.05, 0.0, 0.05}) {
        const double rotation[9] = {std::cos(roll), -std::sin(roll), 0, std::sin(roll), std::cos(roll), 0, 0, 0, 1};
        std::copy_n(rotation, 9, ahead.emplace_back().rotation);
    }
    CHECK(worldUp(ahead)[1] == doctest::Approx(-1));
}

TEST_CASE("up of a model whose cameras hardly turn: the mean of theirs, without one that of COLMAP's axes")
{
    using Up = std::array<double, 3>;
    const Up usual{0, -1, 0};
    CHECK(worldUp({}) == usual);
    std::vector<Camera> cameras(2);
    const double about_x[9] = {1, 0, 0, 0, 0, -1, 0, 1, 0}; // right x, down z, forward -y: up is -z
    std::copy_n(about_x, 9, cameras[0].rotation);
    std::copy_n(about_x, 9, cameras[1].rotation);
    CHECK(worldUp(cameras) == Up{0, 0, -1});
    for (double& value : cameras[1].rotation)
        value *= 1000; // a scale has no say
    cameras[0] = Camera{};
    const Up mixed = worldUp(cameras);
    CHECK(mixed[1] == doctest::Approx(-std::sqrt(0.5)));
    CHECK(mixed[2] == doctest::Approx(-std::sqrt(0.5)));
    cameras[1].rotation[4] = kNan; // does not count
    CHECK(worldUp(cameras) == usual);
    const double upside_down[9] = {-1, 0, 0, 0, -1, 0, 0, 0, 1};
    std::copy_n(upside_down, 9, cameras[1].rotation);
    cameras.resize(3);
    cameras[2].rotation[1] = 1;                                     // down is x + y
    CHECK(worldUp(cameras)[0] == doctest::Approx(-std::sqrt(0.5))); // 0.33 long: enough
    cameras.resize(2);
    CHECK(worldUp(cameras) == usual); // they cancel
}

TEST_CASE("a navigator starts with the whole scene before it, at the speeds of a metre or of the scene")
{
    Navigator navigator(world());
    CHECK(length(vec(navigator.target())) < 1e-9);
    CHECK(elevation(navigator) == doctest::Approx(-30));
    CHECK(navigator.speed() == doctest::Approx(10));
    navigator.setMode(NavigationMode::Walk);
    CHECK(navigator.speed() == doctest::Approx(2.8));
    navigator.setSpeed(3);
    CHECK(navigator.speed() == 3);
    navigator.setSpeed(1e99);
    CHECK(navigator.speed() == doctest::Approx(2800));
    navigator.setSpeed(kNan);
    CHECK(navigator.speed() == doctest::Approx(2800));
    navigator.setMode(NavigationMode::Fly);
    CHECK(navigator.speed() == doctest::Approx(10)); // each has its own

    NavigationWorld without = world();
    without.metre = 0;
    CHECK(Navigator(without).speed() == doctest::Approx(10)); // a twentieth of 200
    NavigationWorld broken;
    broken.up[1] = kNan;
    broken.metre = kNan;
    broken.low[0] = kNan;
    broken.high[2] = kInfinity;
    const Navigator mended(broken);
    CHECK(isWhole(mended));
    CHECK(mended.speed() == doctest::Approx(0.05));
}

TEST_CASE("fly: its usual speed can be set, within the size of the scene, and what was scrolled stays a factor")
{
    Navigator navigator(world());
    navigator.setUsualSpeed(4);
    CHECK(navigator.speed() == doctest::Approx(4));
    navigator.setSpeed(12);
    navigator.setUsualSpeed(2);
    CHECK(navigator.speed() == doctest::Approx(6));
    for (const double none : {0.0, -1.0, kNan}) {
        navigator.setUsualSpeed(none);
        CHECK(navigator.speed() == doctest::Approx(6));
    }
    navigator.setUsualSpeed(kInfinity);
    CHECK(navigator.speed() == doctest::Approx(3 * 100)); // half of 200
    navigator.setUsualSpeed(1e-9);
    CHECK(navigator.speed() == doctest::Approx(3 * 0.1));
    navigator.setMode(NavigationMode::Walk);
    CHECK(navigator.speed() == doctest::Approx(2.8)); // a person's
}

TEST_CASE("fly: moves along the view and the world's up, turns about up and right")
{
    Navigator navigator = navigatorAt(windowCamera({1, 2, 3}));
    NavigationInput input = picture(2);
    CHECK_FALSE(navigator.step(input));
    input.move[2] = 1;
    CHECK(navigator.step(input));
    CHECK(length(vec(navigator.position()) - glm::dvec3(1, 2, 23)) < 1e-12);
    input.move[2] = 0;
    input.move[1] = 5; // more than full is full
    input.fast = true;
    navigator.step(input);
    CHECK(length(vec(navigator.position()) - glm::dvec3(1, -78, 23)) < 1e-12);
    input = picture(1);
    input.move[0] = input.move[2] = 1; // together no faster
    input.slow = true;
    navigator.step(input);
    CHECK(length(vec(navigator.position()) - glm::dvec3(1, -78, 23)) == doctest::Approx(2.5));

    navigator = navigatorAt(windowCamera({0, 0, 0}));
    input = picture(1);
    input.look_rate[0] = 1; // right: forward turns from z towards x
    navigator.step(input);
    CHECK(axesOf(navigator)[2].x == doctest::Approx(1));
    input = picture(1);
    input.look_rate[1] = 0.5; // down
    navigator.step(input);
    CHECK(elevation(navigator) == doctest::Approx(-45));
    input = picture(1);
    input.move[2] = 1; // along the view, down too; its up is the world's
    navigator.step(input);
    CHECK(navigator.position()[1] == doctest::Approx(10 * std::sqrt(0.5)));
    input = picture(1);
    input.move[1] = 1;
    const glm::dvec3 before = vec(navigator.position());
    navigator.step(input);
    CHECK(length(vec(navigator.position()) - before - glm::dvec3(0, -10, 0)) < 1e-12);

    navigator = navigatorAt(windowCamera({0, 0, 0}));
    input = picture();
    input.scroll = 2;
    CHECK_FALSE(navigator.step(input));
    CHECK(navigator.speed() == doctest::Approx(10 * 1.25 * 1.25));
    input.scroll = -1000;
    navigator.step(input);
    CHECK(navigator.speed() == doctest::Approx(0.01));
}

TEST_CASE("a small drag moves the middle of the picture with the cursor, whatever the lens")
{
    for (const uint32_t height : {500u, 1000u, 3000u}) {
        for (const int side : {0, 1}) {
            Navigator navigator = navigatorAt(windowCamera({0, 0, 0}));
            NavigationInput input = picture();
            input.height = height;
            input.fov_y = 60 * kDegree;
            input.look_pixels[side] = 3;
            navigator.step(input);
            const double focal = 0.5 * height / std::tan(30 * kDegree);
            const glm::dvec2 seen = pixelOf(navigator, {0, 0, 1000}) / 500.0 * focal;
            CHECK(seen[side] == doctest::Approx(3).epsilon(1e-4));
            CHECK(std::abs(seen[1 - side]) < 1e-9);
        }
    }
}

TEST_CASE("pitch ends at 89 degrees, and a camera put beyond comes back only")
{
    for (const NavigationMode mode : {NavigationMode::Fly, NavigationMode::Orbit, NavigationMode::Walk}) {
        Navigator navigator = navigatorAt(windowCamera({1, 2, 3}), mode);
        NavigationInput input = picture(1);
        for (const double direction : {1.0, -1.0}) {
            input.look_rate[1] = direction;
            for (int i = 0; i < 5; ++i)
                navigator.step(input);
            CHECK(elevation(navigator) == doctest::Approx(-89 * direction).epsilon(1e-9));
            CHECK(axesOf(navigator)[1].y > 0); // upright
        }
        input.look_rate[1] = 0;
        input.look_pixels[1] = 1e9;
        navigator.step(input);
        CHECK(elevation(navigator) == doctest::Approx(89).epsilon(1e-9));
    }
    Camera down = windowCamera({0, -50, 0});
    const double straight[9] = {1, 0, 0, 0, 0, 1, 0, -1, 0}; // down is -z, forward is +y
    std::copy_n(straight, 9, down.rotation);
    Navigator navigator = navigatorAt(down);
    CHECK(elevation(navigator) == doctest::Approx(-90));
    NavigationInput input = picture(0.5);
    input.look_rate[1] = 1;
    CHECK_FALSE(navigator.step(input));
    input.look_rate[1] = -1;
    CHECK(navigator.step(input));
    CHECK(elevation(navigator) == doctest::Approx(-45));
    input.look_rate[1] = 1;
    input.seconds = 10;
    navigator.step(input);
    CHECK(elevation(navigator) == doctest::Approx(-89));
}

TEST_CASE("orbit: the target stays while one turns and scrolls, and pans with the cursor")
{
    Navigator navigator = navigatorAt(turnedCamera({1, 2, 3}, 0.4, -0.3), NavigationMode::Orbit);
    const glm::dvec3 target = vec(navigator.target());
    NavigationInput input = picture(0.1);
    input.look_pixels[0] = 130;
    input.look_pixels[1] = -70;
    input.scroll = 3;
    navigator.step(input);
    CHECK(length(vec(navigator.target()) - target) < 1e-12);
    CHECK(navigator.distance() == doctest::Approx(10 / std::pow(1.25, 3)));
    CHECK(length(vec(navigator.position()) - target) == doctest::Approx(navigator.distance()));

    // any point as far ahead as the target stays under the cursor
    const glm::dmat3 axes = axesOf(navigator);
    const glm::dvec3 point = vec(navigator.target()) + axes[0] * 0.7 - axes[1] * 1.1;
    const glm::dvec2 before = pixelOf(navigator, point);
    input = picture(0.1);
    input.pan_pixels[0] = 120;
    input.pan_pixels[1] = -45;
    navigator.step(input);
    CHECK(largest(axesOf(navigator) - axes) == 0);
    const glm::dvec2 moved = pixelOf(navigator, point) - before;
    CHECK(moved.x == doctest::Approx(120).epsilon(1e-9));
    CHECK(moved.y == doctest::Approx(-45).epsilon(1e-9));

    input = picture(0.5);
    input.move[0] = 1; // half the distance a second, target and camera alike
    const glm::dvec3 from = vec(navigator.target());
    navigator.step(input);
    CHECK(length(vec(navigator.target()) - from - axes[0] * navigator.distance() * 0.25) < 1e-12);

    input = picture();
    input.scroll = 1e9;
    for (int i = 0; i < 10; ++i)
        navigator.step(input);
    CHECK(navigator.distance() == doctest::Approx(200e-6));
    navigator.setDistance(kNan);
    navigator.setDistance(-1);
    CHECK(navigator.distance() == doctest::Approx(200e-6));
}

TEST_CASE("walk: the height stays however steep one looks")
{
    Navigator navigator = navigatorAt(turnedCamera({1, 2, 3}, 0.4, -1.5), NavigationMode::Walk);
    NavigationInput input = picture(2);
    input.move[2] = 1;
    input.move[1] = 1;
    input.look_rate[1] = -0.2;
    navigator.step(input);
    CHECK(navigator.position()[1] == doctest::Approx(2).epsilon(1e-14));
    const glm::dvec3 way = vec(navigator.position()) - glm::dvec3(1, 2, 3);
    CHECK(length(way) == doctest::Approx(2 * 2.8 / std::sqrt(2))); // one of the two keys has no effect here
    CHECK(std::abs(dot(normalize(way), axesOf(navigator)[0])) < 1e-12);
}

TEST_CASE("steps add up: N of t / N end where one of t ends")
{
    for (const NavigationMode mode : {NavigationMode::Fly, NavigationMode::Orbit, NavigationMode::Walk}) {
        for (int rare = 0; rare < 3; ++rare) {
            CAPTURE(int(mode));
            CAPTURE(rare);
            const Camera start = turnedCamera({1, 2, 3}, 0.4, -0.3, rare == 2 ? 0.5 : 0); // with and without roll
            NavigationInput whole = picture(2);
            whole.move[0] = 0.5;
            whole.move[1] = -0.25;
            whole.move[2] = 0.7;
            whole.look_rate[0] = 0.6;
            whole.look_rate[1] = rare == 1 ? -1 : 0.1; // up to the limit and on
            whole.look_pixels[0] = -40;
            whole.look_pixels[1] = 25;
            whole.pan_pixels[0] = 60;
            whole.pan_pixels[1] = -20;
            whole.scroll = rare == 1 ? 40 : 1.5; // the limits of speed and distance too
            Navigator once = navigatorAt(start, mode);
            once.step(whole);
            for (const int steps : {2, 7, 240}) {
                NavigationInput part = whole;
                for (double* value : {&part.seconds, &part.look_pixels[0], &part.look_pixels[1], &part.pan_pixels[0],
                                      &part.pan_pixels[1], &part.scroll})
                    *value /= steps;
                Navigator often = navigatorAt(start, mode);
                for (int i = 0; i < steps; ++i)
                    often.step(part);
                const glm::dvec3 way = vec(once.position()) - glm::dvec3(1, 2, 3);
                CHECK(length(vec(often.position()) - vec(once.position())) < 1e-11 * (1 + length(way)));
                CHECK(largest(axesOf(often) - axesOf(once)) < 1e-12);
                CHECK(often.speed() == doctest::Approx(once.speed()).epsilon(1e-12));
                CHECK(often.distance() == doctest::Approx(once.distance()).epsilon(1e-12));
                CHECK(length(way) > 0.1);
            }
        }
    }
}

TEST_CASE("the way of a turning camera is what tiny straight steps sum to")
{
    // the reference knows the turns at the middle of each tiny step and nothing of integrals
    NavigationInput whole = picture(1);
    whole.move[0] = 0.3;
    whole.move[2] = 0.8;
    whole.look_rate[0] = 0.9;
    whole.look_rate[1] = -0.4;
    const Camera start = turnedCamera({1, 2, 3}, 0.4, -0.3);
    Navigator once = navigatorAt(start);
    once.step(whole);
    constexpr int kSteps = 20000;
    Navigator turning = navigatorAt(start);
    NavigationInput half = whole;
    half.seconds = 0.5 / kSteps;
    half.move[0] = half.move[2] = 0;
    glm::dvec3 sum(1, 2, 3);
    for (int i = 0; i < kSteps; ++i) {
        turning.step(half);
        const glm::dmat3 axes = axesOf(turning);
        sum += (axes[0] * 0.3 + axes[2] * 0.8) * (10.0 / kSteps);
        turning.step(half);
    }
    CHECK(length(vec(once.position()) - sum) < 1e-7);
}

TEST_CASE("a camera jumped to comes back bit for bit until something changes, and keeps its roll until levelled")
{
    const Camera given = turnedCamera({1234.5, -0.1, 1.0 / 3}, 0.7, -0.4, 0.3);
    Navigator navigator = navigatorAt(given);
    const double origin[3] = {0.1, 0.2, 0.3};
    const auto sameEye = [&] {
        const EyeParams shown = eyeParams(navigator.camera(given), origin), wanted = eyeParams(given, origin);
        return std::memcmp(&shown, &wanted, sizeof(shown)) == 0 &&
               std::memcmp(navigator.camera(given).translation, given.translation, sizeof(given.translation)) == 0;
    };
    CHECK(sameEye());
    CHECK_FALSE(navigator.step(picture(1)));
    CHECK(sameEye());
    NavigationInput input = picture(0.01);
    input.scroll = 1;
    CHECK_FALSE(navigator.step(input)); // the step changes only the speed
    CHECK(sameEye());
    input = picture(0.01);
    input.look_rate[0] = 1;
    CHECK(navigator.step(input));
    CHECK_FALSE(sameEye());
    const double roll = axesOf(navigator)[0].y;
    CHECK(roll == doctest::Approx(glm::dvec3(given.rotation[0], given.rotation[3], given.rotation[6]).y));
    CHECK(std::abs(roll) > 0.1);
    const glm::dvec3 forward = axesOf(navigator)[2];
    navigator.level();
    CHECK(std::abs(axesOf(navigator)[0].y) < 1e-15);
    CHECK(axesOf(navigator)[1].y > 0);
    CHECK(length(axesOf(navigator)[2] - forward) < 1e-15);

    // a scaled rotation, as a transforms file may have it, is brought to size, and the place is the same
    Camera scaled = given;
    for (double& value : scaled.rotation)
        value /= 100;
    for (double& value : scaled.translation)
        value /= 100;
    navigator.jumpTo(scaled);
    CHECK(hasRotation(navigator.camera(given)));
    CHECK(length(vec(navigator.position()) - glm::dvec3(1234.5, -0.1, 1.0 / 3)) < 1e-9);

    // the lens is another camera's
    Camera lens = windowCamera({9, 9, 9});
    lens.name = "lens";
    lens.tan_mid_x = 0.1;
    lens.width = 77;
    const Camera shown = navigator.camera(lens);
    CHECK(shown.name == "lens");
    CHECK(shown.tan_mid_x == 0.1);
    CHECK(shown.width == 77);
    CHECK(shown.fov_y == lens.fov_y);
}

TEST_CASE("animateTo ends at the camera's bits, goes through the middle, and any movement ends it")
{
    const Camera from = turnedCamera({0, 0, 0}, 0, 0), to = turnedCamera({10, 20, 30}, 1, -0.5, 0.2);
    for (const int steps : {1, 3, 100}) {
        Navigator navigator = navigatorAt(from);
        navigator.animateTo(to, 2);
        CHECK(navigator.moves());
        for (int i = 0; i < steps; ++i)
            CHECK(navigator.step(picture(1.0 / steps)));
        CHECK(navigator.moves());
        CHECK(length(vec(navigator.position()) - glm::dvec3(5, 10, 15)) < 1e-9);
        for (int i = 0; i <= steps; ++i)
            navigator.step(picture(1.0 / steps));
        CHECK_FALSE(navigator.moves());
        const Camera end = navigator.camera(to);
        CHECK(std::memcmp(end.rotation, to.rotation, sizeof(to.rotation)) == 0);
        CHECK(std::memcmp(end.translation, to.translation, sizeof(to.translation)) == 0);
    }
    Navigator slow_start = navigatorAt(from);
    slow_start.animateTo(to, 2);
    slow_start.step(picture(0.02));
    CHECK(length(vec(slow_start.position())) < 0.001 * std::sqrt(1400));

    for (int which = 0; which < 5; ++which) {
        CAPTURE(which);
        Navigator navigator = navigatorAt(from);
        navigator.animateTo(to, 2);
        navigator.step(picture(1));
        const glm::dvec3 there = vec(navigator.position());
        NavigationInput input = picture(1e-9);
        input.fast = true;
        navigator.step(input); // is no movement
        CHECK(navigator.moves());
        double* const values[] = {&input.move[1], &input.look_pixels[1], &input.look_rate[0], &input.pan_pixels[0],
                                  &input.scroll};
        *values[which] = kNan; // nor is that
        navigator.step(input);
        CHECK(navigator.moves());
        *values[which] = 0.5;
        navigator.step(input);
        const bool pans = which == 3;
        CHECK(navigator.moves() == pans); // only Orbit pans
        if (pans)
            navigator.setMode(NavigationMode::Orbit);
        navigator.step(input);
        CHECK_FALSE(navigator.moves());
        const glm::dvec3 now = vec(navigator.position());
        navigator.step(picture(1));
        CHECK(length(vec(navigator.position()) - now) < 1e-6); // it stays
        CHECK((pans || length(now - there) < 1e-6));
    }
    Navigator at_once = navigatorAt(from);
    at_once.animateTo(to, kNan);
    CHECK_FALSE(at_once.moves());
    CHECK(at_once.position()[1] == doctest::Approx(20));
    at_once.animateTo(from, kInfinity);
    at_once.step(picture(1));
    CHECK(isWhole(at_once));
}

TEST_CASE("no input makes a pose that is not finite or out of reach")
{
    const double values[] = {kNan, kInfinity, -kInfinity, 1e308, -1e308, 1e-308, 0.3};
    uint32_t state = 1;
    const auto pick = [&] {
        state = state * 1664525u + 1013904223u;
        return values[(state >> 16) % std::size(values)];
    };
    for (const NavigationMode mode : {NavigationMode::Fly, NavigationMode::Orbit, NavigationMode::Walk}) {
        Navigator navigator = navigatorAt(turnedCamera({1, 2, 3}, 0.4, -0.3, 1.2), mode);
        for (int i = 0; i < 2000; ++i) {
            NavigationInput input;
            for (double* value : {&input.seconds, &input.move[0], &input.move[1], &input.move[2], &input.look_pixels[0],
                                  &input.look_pixels[1], &input.look_rate[0], &input.look_rate[1], &input.pan_pixels[0],
                                  &input.pan_pixels[1], &input.scroll, &input.fov_y})
                *value = pick();
            input.height = i % 3 == 0 ? 0 : i % 3 == 1 ? 1 : 0xffffffff;
            navigator.step(input);
            if (i % 50 == 0)
                navigator.animateTo(turnedCamera({pick(), 1, 2}, 0.1, 0.2), pick());
            REQUIRE(isWhole(navigator));
        }
        const glm::dvec3 before = vec(navigator.position());
        Camera broken = windowCamera({0, 0, 0});
        broken.translation[1] = kNan;
        navigator.jumpTo(broken);
        broken = windowCamera({0, 0, 0});
        std::fill_n(broken.rotation, 9, 0.0);
        navigator.jumpTo(broken);
        navigator.animateTo(broken, 0);
        CHECK(length(vec(navigator.position()) - before) == 0);
    }
    Navigator far = navigatorAt(windowCamera({0, 0, 0}));
    far.jumpTo(windowCamera({0, 0, -1e12}));
    CHECK(far.position()[2] == doctest::Approx(-1e6 * 200));
}

TEST_CASE("a hole in the middle of a small picture does not hide how far away the rest is")
{
    const auto none = float(kInfinity);
    CHECK(medianDepth(std::vector<float>{9, 2, none, 3, float(kNan), 4, -none, 2}) == 3.0);
    CHECK(medianDepth(std::vector<float>(256, 7.5f)) == 7.5);
    CHECK(medianDepth(std::vector<float>(256, none)) == std::nullopt);
    CHECK(medianDepth({}) == std::nullopt);
}
