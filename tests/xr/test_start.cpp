// SPDX-License-Identifier: Apache-2.0
#include "player/xr/start.h"

#include <gsc/error.h>
#include "player/xr/xr.h"

#include <doctest/doctest.h>
#include <glm/geometric.hpp>

#include <cmath>
#include <limits>

using namespace gsc;

namespace {

constexpr double kMetre = 0.5; // world units
constexpr std::array<double, 3> kUp = {0, -1, 0};
constexpr float kNothing = std::numeric_limits<float>::infinity();

// At (1, -10, 2), looking along COLMAP's z, tilted down by `pitch`.
Shot shotAt(double pitch)
{
    Shot shot;
    const double c = std::cos(pitch), s = std::sin(pitch);
    const double rotation[9] = {1, 0, 0, 0, c, s, 0, -s, c};
    const double position[3] = {1, -10, 2};
    for (int i = 0; i < 9; ++i)
        shot.camera.rotation[i] = rotation[i];
    for (int i = 0; i < 3; ++i)
        for (int row = 0; row < 3; ++row)
            shot.camera.translation[i] -= rotation[3 * row + i] * position[row];
    shot.camera.fov_x = shot.camera.fov_y = 1;
    return shot;
}

glm::dvec3 centreOf(const Camera& camera)
{
    glm::dvec3 at{};
    for (int row = 0; row < 3; ++row)
        for (int i = 0; i < 3; ++i)
            at[row] -= camera.rotation[3 * row + i] * camera.translation[i];
    return at;
}

// 20 groups in a row of 8 units along x, half a unit high, and two that lie far away.
struct Model {
    std::vector<GroupRecord> groups;
    ModelParams params{};
    ModelView view{};

    Model()
    {
        for (int i = 0; i < 22; ++i) {
            GroupRecord group{};
            const float x = i < 20 ? 0.4f * float(i) : 1000.0f * float(2 * i - 41), box[3] = {0.4f, 0.5f, 1};
            for (int a = 0; a < 3; ++a) {
                group.anchor_min[a] = a == 0 ? x : 0;
                group.anchor_max[a] = group.anchor_min[a] + box[a];
            }
            groups.push_back(group);
        }
        params.group_count = groups.size();
        view.params = &params;
        view.groups = groups.data();
        view.origin[0] = 100;
    }
};

EyeDepths filled(const Shot& shot, uint32_t eyes, float depth)
{
    EyeDepths depths;
    for (uint32_t e = 0; e < eyes; ++e)
        depths[e].assign(size_t(shot.camera.width) * shot.camera.height, depth);
    return depths;
}

EyeDepths neverDrawn(const Shot&, uint32_t)
{
    FAIL("this start needs no picture");
    return {};
}

bool near(const glm::dvec3& a, const glm::dvec3& b, double tolerance = 1e-9)
{
    return glm::length(a - b) <= tolerance;
}

} // namespace

TEST_CASE("a start at the camera has a level head there, and needs no picture")
{
    const Model model;
    const Start start = chooseStart(StartPlace::Camera, model.view, shotAt(0.7), kUp, kMetre, neverDrawn);
    CHECK(start.place == StartPlace::Camera);
    CHECK(near(start.eyes.origin(), {1, -10, 2}));
    CHECK(near(start.eyes.axes()[1], {0, -1, 0}));
    CHECK(near(start.eyes.axes()[2], {0, 0, -1}));
    CHECK(start.eyes.scale() == kMetre);
}

TEST_CASE("a start on the ground stands where the middle of the first picture is, 1.6 m up, facing the same way")
{
    const Model model;
    const double pitch = 0.7;
    const auto draw = [&](const Shot& shot, uint32_t eyes) {
        CHECK(eyes == 1);
        EyeDepths depths = filled(shot, eyes, 99);
        const uint32_t width = shot.camera.width;
        for (uint32_t y = 3 * width / 8; y < 5 * width / 8; ++y) // the middle alone counts, and its outliers do not
            for (uint32_t x = 3 * width / 8; x < 5 * width / 8; ++x)
                depths[0][y * width + x] = (x + y) % 4 == 0 ? kNothing : 5.0f;
        return depths;
    };
    const Start start = chooseStart(StartPlace::Ground, model.view, shotAt(pitch), kUp, kMetre, draw);
    CHECK(start.place == StartPlace::Ground);
    const glm::dvec3 ground(1, -10 + 5 * std::sin(pitch), 2 + 5 * std::cos(pitch));
    CHECK(near(start.eyes.origin(), ground + glm::dvec3(0, -1.6 * kMetre, 0)));
    CHECK(near(start.eyes.axes()[2], {0, 0, -1}));
    CHECK(start.eyes.scale() == kMetre);
}

TEST_CASE("without ground in the middle of the first picture, or without a picture, one starts at the camera")
{
    const Model model;
    const DrawDepths nothing = [](const Shot& shot, uint32_t eyes) { return filled(shot, eyes, kNothing); };
    const DrawDepths none = [](const Shot&, uint32_t) { return EyeDepths(); };
    for (const DrawDepths& draw : {nothing, none})
        for (const StartPlace wanted : {StartPlace::Ground, StartPlace::Most}) {
            const Start start = chooseStart(wanted, model.view, shotAt(0.7), kUp, kMetre, draw);
            CHECK(start.place == StartPlace::Camera);
            CHECK(near(start.eyes.origin(), {1, -10, 2}));
        }
    CHECK(startText(chooseStart(StartPlace::Most, model.view, shotAt(0), kUp, kMetre, none)) ==
          "starts at the first camera");
}

TEST_CASE("a table-top is a metre wide without what lies far away, and lies in front of the eyes and below")
{
    const Model model;
    const Start start = chooseStart(StartPlace::Table, model.view, shotAt(0.7), kUp, kMetre, neverDrawn);
    CHECK(start.place == StartPlace::Table);
    CHECK(start.eyes.scale() == doctest::Approx(8).epsilon(0.1));
    const glm::dvec3 middle(104, 0.25, 0.5); // with the model's origin
    const glm::dvec3 seen =
        glm::transpose(start.eyes.axes()) * (middle - start.eyes.origin()) / start.eyes.scale(); // in the space
    CHECK(near(seen, {0, -0.35, -0.6}, 0.02));
}

TEST_CASE("the start that shows most is the default, but a wall before the nose shows nothing")
{
    const Model model;
    const Shot first = shotAt(0.7);
    // depth that each start sees, told apart by where its eyes are: high above, near the ground, or far along x
    float camera = 0, ground = 0, table = 0;
    const auto draw = [&](const Shot& shot, uint32_t eyes) {
        if (eyes == 1)
            return filled(shot, eyes, 5);
        const glm::dvec3 at = centreOf(shot.camera);
        EyeDepths depths = filled(shot, eyes, at.x > 50 ? table : at.y < -9 ? camera : ground);
        if (at.x <= 50 && at.y < -9) // half of the right eye's picture
            std::fill_n(depths[1].begin(), depths[1].size() / 2, kNothing);
        CHECK(centreOf(*shot.right_eye).x - at.x == doctest::Approx(0.064 * (at.x > 50 ? 8 : kMetre)).epsilon(0.1));
        return depths;
    };
    const auto chosen = [&](float of_camera, float of_ground, float of_table) {
        camera = of_camera;
        ground = of_ground;
        table = of_table;
        return chooseStart(StartPlace::Most, model.view, first, kUp, kMetre, draw);
    };
    CHECK(chosen(5, 5, kNothing).place == StartPlace::Ground);
    CHECK(chosen(5, 0.4f, kNothing).place == StartPlace::Camera); // 0.8 m
    CHECK(chosen(5, kNothing, 4).place == StartPlace::Table);     // half a metre of a table-top's
    CHECK(chosen(5, kNothing, 1).place == StartPlace::Camera);
    const Start start = chosen(5, 5, kNothing);
    CHECK(*start.shown[size_t(StartPlace::Camera)] == 0.5);
    CHECK(startText(start) == "starts on the ground; of an eye's picture the model fills 50 % at the first camera, 100 "
                              "% on the ground, 0 % before a table-top");
}

TEST_CASE("a list of what there is without a headset is of what was looked for")
{
    const Error why(ErrorCode::Unsupported, "headset", "this build has none", "another", "build again");
    HeadsetFacts known;
    CHECK(headsetText(known, why).empty());
    known.loader = "libopenxr_loader.so";
    CHECK(headsetText(known, why).find("vulkan      none\n") != std::string::npos);
}
