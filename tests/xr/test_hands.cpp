// SPDX-License-Identifier: Apache-2.0
#include "player/xr/hands.h"

#include <doctest/doctest.h>
#include <glm/geometric.hpp>

#include <cmath>
#include <numbers>

using namespace gsc;

namespace {

constexpr std::array<double, 3> kUp = {0, -1, 0};
constexpr double kStep = 0.01; // seconds

struct Viewer {
    Placement place{Camera{}, kUp, 1, 0}; // in COLMAP's axes: looks along z, up is -y
    Hands hands{place, -1.6};
    SpacePose head;
    HeadsetInput input;

    bool step(double seconds = kStep) { return hands.step(place, input, head, seconds); }
};

bool near(const glm::dvec3& a, const glm::dvec3& b)
{
    return glm::length(a - b) <= 1e-9;
}

} // namespace

TEST_CASE("hands: nothing is done, nothing moves")
{
    Viewer viewer;
    CHECK_FALSE(viewer.step());
    viewer.input.hands[0].grip = SpacePose{{1, 2, 3}};
    viewer.input.hands[0].stick[1] = 0.1; // a stick at rest
    viewer.input.hands[1].aim = SpacePose{};
    CHECK_FALSE(viewer.step());
    CHECK(near(viewer.place.origin(), {0, 0, 0}));
}

TEST_CASE("hands: the left stick walks where the head looks, level")
{
    Viewer viewer;
    viewer.head.rotation = glm::angleAxis(-0.8, glm::dvec3(1, 0, 0)); // down
    viewer.input.hands[0].stick[1] = 1;
    CHECK(viewer.step());
    CHECK(viewer.place.origin().z == doctest::Approx(2.5 * kStep));
    CHECK(std::abs(viewer.place.origin().y) < 1e-12);
    viewer.input.hands[0].stick[1] = 0;
    viewer.input.hands[0].stick[0] = -1;
    viewer.step();
    CHECK(viewer.place.origin().x == doctest::Approx(-2.5 * kStep));
    viewer.input.hands[0].stick[0] = 0;
    viewer.input.hands[1].stick[1] = 1;
    viewer.step();
    CHECK(viewer.place.origin().y == doctest::Approx(-2.5 * kStep)); // up
    viewer.step(100);                                                // was away
    CHECK(viewer.place.origin().y == doctest::Approx(-2.5 * (kStep + 0.1)));
    viewer.head.rotation =
        glm::angleAxis(-std::numbers::pi / 2, glm::dvec3(1, 0, 0)); // straight down: ahead is what is up
    viewer.input.hands[1].stick[1] = 0;
    viewer.input.hands[0].stick[1] = 1;
    const double before = viewer.place.origin().z;
    viewer.step();
    CHECK(viewer.place.origin().z - before == doctest::Approx(2.5 * kStep));
}

TEST_CASE("hands: the right stick turns by 30 degrees, once for each push")
{
    Viewer viewer;
    viewer.head.position = {0.3, 0, 0.4};
    const glm::dvec3 at = viewer.place.toWorld(viewer.head.position);
    viewer.input.hands[1].stick[0] = 1;
    CHECK(viewer.step());
    CHECK_FALSE(viewer.step());
    const glm::dvec3 forward = viewer.place.axes() * glm::dvec3(0, 0, -1);
    CHECK(near(forward, {0.5, 0, std::sqrt(0.75)})); // to the right
    CHECK(near(viewer.place.toWorld(viewer.head.position), at));
    viewer.input.hands[1].stick[0] = 0.5; // not let go
    CHECK_FALSE(viewer.step());
    viewer.input.hands[1].stick[0] = 0;
    CHECK_FALSE(viewer.step());
    viewer.input.hands[1].stick[0] = -1;
    CHECK(viewer.step());
    CHECK(near(viewer.place.axes() * glm::dvec3(0, 0, -1), {0, 0, 1}));
}

TEST_CASE("hands: a grip holds the world, two scale it, and a finger that trembles does not let go")
{
    Viewer viewer;
    HandInput &left = viewer.input.hands[0], &right = viewer.input.hands[1];
    left.grip = SpacePose{{-0.2, 0, -0.5}};
    left.grab = 1;
    CHECK_FALSE(viewer.step());
    const glm::dvec3 held = viewer.place.toWorld(left.grip->position);
    left.grip->position = {-0.1, 0.1, -0.4};
    left.grab = 0.5;
    CHECK(viewer.step());
    CHECK(near(viewer.place.toWorld(left.grip->position), held));
    right.grip = SpacePose{{0.3, 0.1, -0.4}};
    right.grab = 1;
    left.grip->position.x -= 0.05; // in the step in which the other comes
    viewer.step();
    const glm::dvec3 other = viewer.place.toWorld(right.grip->position),
                     first = viewer.place.toWorld(left.grip->position);
    right.grip->position.x += 0.45;
    CHECK(viewer.step());
    CHECK(viewer.place.scale() == doctest::Approx(0.5));
    CHECK(near(viewer.place.toWorld(right.grip->position), other));
    CHECK(near(viewer.place.toWorld(left.grip->position), first));
    left.grab = right.grab = 0.3;
    right.grip->position = {0, 0, 0};
    CHECK_FALSE(viewer.step());

    viewer.input.hands[1].menu = true;
    CHECK(viewer.step());
    CHECK(viewer.place.scale() == 1);
    CHECK(near(viewer.place.origin(), {0, 0, 0}));
    CHECK_FALSE(viewer.step()); // held down
}

TEST_CASE("hands: a trigger that is let go goes where it points, and keeps the height")
{
    Viewer viewer;
    viewer.head.position = {0.1, 0.05, 0.2};
    HandInput& right = viewer.input.hands[1];
    right.aim = SpacePose{{0.2, -0.4, 0}, glm::angleAxis(-std::numbers::pi / 4, glm::dvec3(1, 0, 0))};
    right.teleport = true;
    CHECK_FALSE(viewer.step());
    const glm::dvec3 aimed = viewer.place.toWorld({0.2, 0.05, -1.2}); // above the point of the floor
    right.teleport = false;
    CHECK(viewer.step());
    CHECK(near(viewer.place.toWorld(viewer.head.position), aimed));
    CHECK_FALSE(viewer.step());
    right.teleport = true;
    viewer.step();
    right.aim.reset(); // not tracked any more
    right.teleport = false;
    CHECK_FALSE(viewer.step());
}
