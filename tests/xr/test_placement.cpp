// SPDX-License-Identifier: Apache-2.0
#include "player/poses/placement.h"

#include "player/xr/ride.h"

#include <doctest/doctest.h>
#include <glm/geometric.hpp>
#include <glm/gtc/type_ptr.hpp>

#include <cmath>
#include <limits>
#include <numbers>

using namespace gsc;

namespace {

constexpr double kMetre = 0.8; // world units
constexpr std::array<double, 3> kUp = {0, -1, 0};

// Stands at `position` and looks along COLMAP's z, turned by `yaw` to the right and tilted down by `pitch`.
Camera cameraAt(const glm::dvec3& position, double yaw, double pitch)
{
    Camera camera;
    const glm::dvec3 forward(std::sin(yaw) * std::cos(pitch), std::sin(pitch), std::cos(yaw) * std::cos(pitch));
    const glm::dvec3 right(std::cos(yaw), 0, -std::sin(yaw)), down = glm::cross(forward, right);
    const glm::dvec3 axes[3] = {right, down, forward};
    for (int i = 0; i < 3; ++i) {
        for (int row = 0; row < 3; ++row)
            camera.rotation[3 * row + i] = axes[i][row];
        camera.translation[i] = -glm::dot(axes[i], position);
    }
    camera.fov_x = camera.fov_y = 1;
    camera.width = camera.height = 32;
    return camera;
}

glm::dvec3 centre(const Camera& camera)
{
    glm::dvec3 out{};
    for (int row = 0; row < 3; ++row)
        for (int i = 0; i < 3; ++i)
            out[row] -= camera.rotation[3 * row + i] * camera.translation[i];
    return out;
}

glm::dvec3 axis(const Camera& camera, int i)
{
    return {camera.rotation[i], camera.rotation[3 + i], camera.rotation[6 + i]};
}

bool near(const glm::dvec3& a, const glm::dvec3& b, double tolerance = 1e-12)
{
    return glm::length(a - b) <= tolerance;
}

SpaceEye eyeAt(const glm::dvec3& position, const glm::dquat& rotation = {1.0, 0.0, 0.0, 0.0})
{
    return {{position, rotation}, -0.9, 0.7, 0.8, -0.95};
}

} // namespace

TEST_CASE("placement: the space starts at the camera, level, as large as the metre says")
{
    const Camera camera = cameraAt({3, -2, 5}, 0.4, 0.3);
    const Placement placement(camera, kUp, kMetre, 0);
    const Camera eye = placement.eye(eyeAt({0, 0, 0}), camera);
    CHECK(near(centre(eye), {3, -2, 5}));
    CHECK(near(axis(eye, 2), {std::sin(0.4), 0, std::cos(0.4)})); // the tilt is the viewer's own
    CHECK(near(axis(eye, 1), {0, 1, 0}));
    // a metre to the right, up and back, in OpenXR's axes
    CHECK(near(centre(placement.eye(eyeAt({1, 0, 0}), camera)), glm::dvec3(3, -2, 5) + kMetre * axis(eye, 0)));
    CHECK(near(centre(placement.eye(eyeAt({0, 1, 0}), camera)), glm::dvec3(3, -2 - kMetre, 5)));
    CHECK(near(centre(placement.eye(eyeAt({0, 0, 1}), camera)), glm::dvec3(3, -2, 5) - kMetre * axis(eye, 2)));
    // on a floor eyes are where the camera was if they are as high above it
    const Placement floor(camera, kUp, kMetre, 1.6);
    CHECK(near(centre(floor.eye(eyeAt({0, 1.6, 0}), camera)), {3, -2, 5}));
}

TEST_CASE("placement: an eye turns as OpenXR says and keeps its lens")
{
    const Camera camera = cameraAt({0, 0, 0}, 0, 0);
    const Placement placement(camera, kUp, 1, 0);
    // to the left: about y, which points up
    const Camera left = placement.eye(eyeAt({0, 0, 0}, glm::angleAxis(0.2, glm::dvec3(0, 1, 0))), camera);
    CHECK(near(axis(left, 2), {-std::sin(0.2), 0, std::cos(0.2)}));
    // up: about x
    const Camera up = placement.eye(eyeAt({0, 0, 0}, glm::angleAxis(0.2, glm::dvec3(1, 0, 0))), camera);
    CHECK(near(axis(up, 2), {0, -std::sin(0.2), std::cos(0.2)}));
    // the left edge of the image is at tan(left), the upper one at tan(up), which is above the axis
    CHECK(up.tan_mid_x - std::tan(up.fov_x / 2) == doctest::Approx(std::tan(-0.9)).epsilon(1e-12));
    CHECK(up.tan_mid_x + std::tan(up.fov_x / 2) == doctest::Approx(std::tan(0.7)).epsilon(1e-12));
    CHECK(up.tan_mid_y - std::tan(up.fov_y / 2) == doctest::Approx(-std::tan(0.8)).epsilon(1e-12));
    CHECK(up.tan_mid_y + std::tan(up.fov_y / 2) == doctest::Approx(std::tan(0.95)).epsilon(1e-12));
}

TEST_CASE("placement: turning keeps the head where it is")
{
    Placement placement(cameraAt({1, 2, 3}, 0.1, 0), kUp, kMetre, 0);
    const glm::dvec3 head(0.5, 1.2, -0.3), before = placement.toWorld(head);
    const glm::dvec3 forward = placement.axes() * glm::dvec3(0, 0, -1);
    placement.turn(0.5, head);
    CHECK(near(placement.toWorld(head), before));
    const glm::dvec3 now = placement.axes() * glm::dvec3(0, 0, -1);
    CHECK(glm::dot(now, forward) == doctest::Approx(std::cos(0.5)));
    CHECK(glm::dot(glm::cross(forward, now), placement.axes()[1]) > 0); // counterclockwise from above
    CHECK(near(placement.axes()[1], {0, -1, 0}));
}

TEST_CASE("placement: hands hold the world")
{
    Placement placement(cameraAt({1, 2, 3}, 0.1, 0), kUp, kMetre, 0);
    const glm::dvec3 from(0.2, -0.3, -0.5), to(0.4, -0.1, -0.2), held = placement.toWorld(from);
    placement.drag(from, to);
    CHECK(near(placement.toWorld(to), held));

    // two that only move apart, or turn: both points stay in the hands
    const glm::dvec3 a[2] = {{-0.2, -0.3, -0.5}, {0.2, -0.3, -0.5}}, b[2] = {{-0.4, -0.3, -0.5}, {0.4, -0.3, -0.5}};
    glm::dvec3 world[2] = {placement.toWorld(a[0]), placement.toWorld(a[1])};
    placement.drag(a, b);
    CHECK(placement.scale() == doctest::Approx(kMetre / 2)); // the world got larger, so a metre of it is less
    for (int i = 0; i < 2; ++i)
        CHECK(near(placement.toWorld(b[i]), world[i]));
    const double c = std::cos(0.7), s = std::sin(0.7);
    const glm::dvec3 turned[2] = {{-0.4 * c, -0.3, -0.5 + 0.4 * s}, {0.4 * c, -0.3, -0.5 - 0.4 * s}};
    placement.drag(b, turned);
    for (int i = 0; i < 2; ++i)
        CHECK(near(placement.toWorld(turned[i]), world[i]));
    CHECK(near(placement.axes()[1], {0, -1, 0}));
}

TEST_CASE("placement: what makes no sense changes nothing")
{
    const double nan = std::numeric_limits<double>::quiet_NaN();
    Placement placement(cameraAt({1, 2, 3}, 0.1, 0), kUp, kMetre, 0);
    const glm::dvec3 origin = placement.origin();
    placement.move({nan, 0, 0});
    placement.turn(nan, {0, 0, 0});
    const glm::dvec3 same[2] = {{0, 0, 0}, {0, 0, 0}}, apart[2] = {{0, 0, 0}, {1, 0, 0}},
                     lost[2] = {{nan, 0, 0}, {1, 0, 0}};
    placement.drag(same, apart);
    placement.drag(apart, same);
    placement.drag(apart, lost);
    CHECK(placement.origin() == origin);
    // the scale has ends
    for (int i = 0; i < 100; ++i) {
        const glm::dvec3 narrow[2] = {{-0.05, 0, 0}, {0.05, 0, 0}}, wide[2] = {{-0.5, 0, 0}, {0.5, 0, 0}};
        placement.drag(narrow, wide);
    }
    CHECK(placement.scale() == doctest::Approx(kMetre / 1000));
    CHECK(std::isfinite(placement.origin().x));

    const std::array<double, 3> no_up = {0, 0, nan};
    const Placement mended(cameraAt({1, 2, 3}, 0.1, 0), no_up, -1, 0);
    CHECK(mended.scale() == 1);
    CHECK(near(mended.axes()[1], {0, -1, 0}));
    // straight down: what is up in the picture is ahead
    const Placement down(cameraAt({0, 0, 0}, 0, std::numbers::pi / 2), kUp, 1, 0);
    CHECK(near(down.axes() * glm::dvec3(0, 0, -1), {0, 0, 1}));
    CHECK_FALSE(Placement::isPlace({nan, 0, 0}, glm::dmat3(1.0)));
    CHECK_FALSE(Placement::isPlace({0, 0, 0}, glm::dmat3(2.0)));
    CHECK_FALSE(
        Placement::isPlace({0, 0, 0}, glm::dmat3(glm::dvec3(-1, 0, 0), glm::dvec3(0, 1, 0), glm::dvec3(0, 0, 1))));
    CHECK(Placement::isPlace(down.origin(), down.axes()));
}

TEST_CASE("placement: a hand points at the floor")
{
    SpacePose hand{{0.2, -0.4, 0}, glm::angleAxis(-std::numbers::pi / 4, glm::dvec3(1, 0, 0))}; // 45 degrees down
    const std::optional<glm::dvec3> to = pointOnFloor(hand, -1.6, 15);
    REQUIRE(to);
    CHECK(near(*to, {0.2, -1.6, -1.2}));
    CHECK(near(*pointOnFloor(hand, -1.6, 0.5), {0.2, -1.6, -0.5}));
    hand.rotation = glm::angleAxis(0.1, glm::dvec3(1, 0, 0));
    CHECK_FALSE(pointOnFloor(hand, -1.6, 15));
    hand.position.y = -2;
    hand.rotation = glm::angleAxis(-1.0, glm::dvec3(1, 0, 0));
    CHECK_FALSE(pointOnFloor(hand, -1.6, 15));
}

TEST_CASE("placement: gaze is right and down in the view of each eye")
{
    const auto turned = [](double yaw, double pitch) {
        return glm::angleAxis(yaw, glm::dvec3(0, 1, 0)) * glm::angleAxis(pitch, glm::dvec3(1, 0, 0));
    };
    const SpaceEye eye = eyeAt({1, 2, 3}, turned(0.3, 0)); // looks to the left
    const std::array<float, 2> ahead = gazeOf(eye, {{0, 0, 0}, turned(0.3, 0)});
    CHECK(std::abs(ahead[0]) < 1e-6f);
    CHECK(std::abs(ahead[1]) < 1e-6f);
    const std::array<float, 2> right = gazeOf(eye, {{0, 0, 0}, turned(0, 0)});
    CHECK(double(right[0]) == doctest::Approx(std::tan(0.3)));
    CHECK(double(gazeOf(eyeAt({0, 0, 0}), {{0, 0, 0}, turned(0, -0.2)})[1]) == doctest::Approx(std::tan(0.2))); // down
    CHECK(gazeOf(eyeAt({0, 0, 0}), {{0, 0, 0}, turned(1.2, 0)}) == std::array<float, 2>{0, 0});
    CHECK(gazeOf(eyeAt({0, 0, 0}), {{0, 0, 0}, turned(3.1, 0)}) == std::array<float, 2>{0, 0});
}

TEST_CASE("ride: at cameras it is their place, between them on the straight way, outside it stands")
{
    const std::vector<Camera> cameras = {cameraAt({0, 0, 0}, 0, 0.2), cameraAt({2, 0, 4}, 0.6, 0.2),
                                         cameraAt({2, 0, 8}, 0.6, 0)};
    const Ride ride(cameras, 10, kUp, kMetre, 0);
    for (size_t i = 0; i < cameras.size(); ++i) {
        const Placement wanted(cameras[i], kUp, kMetre, 0), got = ride.at(double(i) / 10);
        CHECK(near(got.origin(), wanted.origin(), 1e-9));
        CHECK(near(got.axes()[2], wanted.axes()[2], 1e-9));
    }
    CHECK(near(ride.at(0.05).origin(), {1, 0, 2}, 1e-9));
    CHECK(near(ride.at(-1).origin(), {0, 0, 0}));
    CHECK(near(ride.at(9).origin(), {2, 0, 8}));
}
