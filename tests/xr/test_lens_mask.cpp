// SPDX-License-Identifier: Apache-2.0
#include "player/xr/lens_mask.h"

#include "player/present/headset/layer_depth.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

using namespace gsc;

namespace {

constexpr uint32_t kWidth = 1000, kHeight = 900; // no multiples of a square

SpaceEye eyeOf(double left, double right, double up, double down)
{
    constexpr double kDegree = std::numbers::pi / 180;
    return {{}, left * kDegree, right * kDegree, up * kDegree, down * kDegree};
}

struct Ellipse {
    double x, y, wide, high; // middle and half axes at depth 1, right and up
};

// Mesh between an ellipse, as a polygon within it, and a frame far around it.
HiddenMesh around(const Ellipse& lens, int corners = 64)
{
    HiddenMesh mesh;
    for (int i = 0; i < corners; ++i) {
        const double angle = 2 * std::numbers::pi * i / corners;
        for (const double far : {1.0, 10.0})
            mesh.vertices.push_back(
                {float(lens.x + far * lens.wide * std::cos(angle)), float(lens.y + far * lens.high * std::sin(angle))});
        const auto a = uint32_t(2 * i), b = uint32_t(2 * ((i + 1) % corners));
        mesh.indices.insert(mesh.indices.end(), {a, a + 1, b, b + 1, b, a + 1});
    }
    return mesh;
}

bool shows(const LensShape& lens, uint32_t column, uint32_t row)
{
    return !lens.masks || (column >= lens.first[row] && column < lens.end[row]);
}

// Where the corners of all pixels of a square, grown by `by` on each side and cut at the picture's, lie inside of the ellipse
// (outside where `wants` is false).
bool wholly(const Ellipse& lens, const SpaceEye& eye, uint32_t column, uint32_t row, double by, bool wants)
{
    const double left = std::tan(eye.left), up = std::tan(eye.up);
    const double x0 = std::max(column * 32.0 - by, 0.0), x1 = std::min(column * 32.0 + 32 + by, double(kWidth)),
                 y0 = std::max(row * 32.0 - by, 0.0), y1 = std::min(row * 32.0 + 32 + by, double(kHeight));
    for (double y = y0; y <= y1; y += 0.5)
        for (double x = x0; x <= x1; x += 0.5) {
            const double u = (left + x / kWidth * (std::tan(eye.right) - left) - lens.x) / lens.wide,
                         v = (up - y / kHeight * (up - std::tan(eye.down)) - lens.y) / lens.high;
            if ((u * u + v * v < 1) != wants)
                return false;
        }
    return true;
}

} // namespace

TEST_CASE("lens mask: an ellipse hides the corners of a picture and nothing that is seen")
{
    for (const auto& [eye, lens] : {std::pair{eyeOf(-45, 45, 45, -45), Ellipse{0, 0, 1, 1}},
                                    std::pair{eyeOf(-52, 40, 44, -50), Ellipse{-0.2, -0.1, 1.05, 1.0}},
                                    std::pair{eyeOf(-20, 55, 50, -10), Ellipse{0.5, 0.4, 0.8, 0.7}}}) {
        CAPTURE(eye.left);
        const LensShape shape = lensShape(around(lens, 720), eye, kWidth, kHeight);
        REQUIRE(shape.masks);
        uint32_t hidden = 0, could = 0;
        for (uint32_t row = 0; row < 29; ++row) {
            REQUIRE(shape.first[row] <= shape.end[row]);
            REQUIRE(shape.end[row] <= 32);
            for (uint32_t column = 0; column < 32; ++column) {
                CAPTURE(row);
                CAPTURE(column);
                hidden += !shows(shape, column, row);
                if (!shows(shape, column,
                           row)) // the polygon lies within the ellipse by less than a hundredth of a pixel
                    REQUIRE(wholly(lens, eye, column, row, 1, false));
                if (wholly(lens, eye, column, row, 3, false)) {
                    ++could;
                    REQUIRE_FALSE(shows(shape, column, row));
                }
            }
        }
        CHECK(could > 50);
        CHECK(hidden >= could);
        const double share = hiddenShare(shape, kWidth, kHeight);
        CHECK(share == doctest::Approx(hidden / (32.0 * 29)).epsilon(0.1)); // the last row and column are cut
    }
}

TEST_CASE("lens mask: up of a mesh is up of the picture, and its right is right")
{
    HiddenMesh mesh; // a corner at the left, above
    mesh.vertices = {{-1, 1}, {-0.5f, 1}, {-1, 0}};
    mesh.indices = {0, 1, 2};
    const LensShape shape = lensShape(mesh, eyeOf(-45, 45, 45, -45), 640, 640);
    REQUIRE(shape.masks);
    CHECK(shape.first[0] > 0);
    CHECK(shape.end[0] == 20);
    CHECK(shape.first[0] > shape.first[5]);
    for (uint32_t row = 10; row < 20; ++row)
        CHECK((shape.first[row] == 0 && shape.end[row] == 20));
}

TEST_CASE("lens mask: a square is hidden only with the pixels around it")
{
    const SpaceEye eye = eyeOf(-45, 45, 45, -45);
    const auto strip = [&](double pixels) { // hides columns at the left of a picture of 640
        const auto x = float(-1 + pixels / 320);
        HiddenMesh mesh;
        mesh.vertices = {{-2, 2}, {x, 2}, {-2, -2}, {x, -2}};
        mesh.indices = {0, 1, 2, 1, 3, 2};
        return lensShape(mesh, eye, 640, 640);
    };
    CHECK(strip(33.4) == LensShape{});
    CHECK(strip(33.6).first[3] == 1); // the middle of the 34th pixel
    CHECK(strip(65.4).first[3] == 1);
    CHECK(strip(65.6).first[3] == 2);
}

TEST_CASE("lens mask: a row between two that are hidden, and what is below those that a shape tells of")
{
    HiddenMesh mesh; // but for the middle fifth of the height, all is hidden
    mesh.vertices = {{-2, 2}, {2, 2}, {-2, 0.2f}, {2, 0.2f}, {-2, -0.2f}, {2, -0.2f}, {-2, -2}, {2, -2}};
    mesh.indices = {0, 1, 2, 1, 3, 2, 4, 5, 6, 5, 7, 6};
    const SpaceEye eye = eyeOf(-45, 45, 45, -45);
    const LensShape shape = lensShape(mesh, eye, 640, 640);
    REQUIRE(shape.masks);
    CHECK(shape.first[0] >= shape.end[0]);
    CHECK((shape.first[10] == 0 && shape.end[10] == 20));
    CHECK(shape.first[19] >= shape.end[19]);
    CHECK(hiddenShare(shape, 640, 640) == doctest::Approx(14.0 / 20)); // a margin takes a row on each side

    mesh.indices.resize(6); // above only
    const LensShape high = lensShape(mesh, eye, 64, 5000);
    REQUIRE(high.masks);
    CHECK(high.first[0] >= high.end[0]);
    CHECK(high.end[kLensRows - 1] == 2);
    CHECK(lensShape(mesh, eye, 255 * 32 + 1, 640) == LensShape{}); // wider than a shape can tell
    CHECK(lensShape(mesh, eye, 255 * 32, 640).end[10] == 255);
}

TEST_CASE("lens mask: without a mesh, and where nothing would be left, everything is shown")
{
    const SpaceEye eye = eyeOf(-45, 45, 45, -45);
    CHECK(lensShape({}, eye, kWidth, kHeight) == LensShape{});
    CHECK(meshFault({}).empty());
    CHECK(hiddenShare({}, kWidth, kHeight) == 0);
    HiddenMesh all;
    all.vertices = {{-9, -9}, {9, -9}, {0, 30}};
    all.indices = {0, 1, 2};
    CHECK(lensShape(all, eye, kWidth, kHeight) == LensShape{});
    all.indices = {0, 0, 0, 1, 1, 2}; // without an area
    CHECK(lensShape(all, eye, kWidth, kHeight) == LensShape{});
}

TEST_CASE("lens mask: hostile meshes and views hide nothing")
{
    const SpaceEye eye = eyeOf(-45, 45, 45, -45);
    const HiddenMesh good = around({0, 0, 1, 1});
    REQUIRE(lensShape(good, eye, kWidth, kHeight).masks);
    const auto spoilt = [&](const auto& spoil) {
        HiddenMesh mesh = good;
        spoil(mesh);
        CHECK_FALSE(meshFault(mesh).empty());
        CHECK(lensShape(mesh, eye, kWidth, kHeight) == LensShape{});
    };
    spoilt([](HiddenMesh& mesh) { mesh.indices.pop_back(); });
    spoilt([](HiddenMesh& mesh) { mesh.indices[7] = uint32_t(mesh.vertices.size()); });
    spoilt([](HiddenMesh& mesh) { mesh.indices.back() = std::numeric_limits<uint32_t>::max(); });
    spoilt([](HiddenMesh& mesh) { mesh.vertices.clear(); });
    spoilt([](HiddenMesh& mesh) { mesh.vertices[3][0] = std::numeric_limits<float>::quiet_NaN(); });
    spoilt([](HiddenMesh& mesh) { mesh.vertices[3][1] = -std::numeric_limits<float>::infinity(); });
    spoilt([](HiddenMesh& mesh) { mesh.fault = "cannot be had"; });
    spoilt([](HiddenMesh& mesh) { mesh.indices.resize(3 * 5000, 0); }); // the frame loop would wait too long
    for (const SpaceEye& odd : {eyeOf(45, -45, 45, -45), eyeOf(-45, 45, 45, 45), eyeOf(-90, 45, 45, -45),
                                eyeOf(-45, std::numeric_limits<double>::quiet_NaN(), 45, -45)})
        CHECK(lensShape(good, odd, kWidth, kHeight) == LensShape{});
    CHECK(lensShape(good, eye, 0, kHeight) == LensShape{});
    CHECK(lensShape(good, eye, kWidth, 0) == LensShape{});
    HiddenMesh huge = good; // finite, and far beyond every picture
    for (auto& vertex : huge.vertices)
        vertex = {vertex[0] * 1e37f, vertex[1] * 1e37f};
    CHECK(lensShape(huge, eye, kWidth, kHeight) == LensShape{});
}

TEST_CASE("layer depth: from 1 at the nearest to 0 at the farthest, and back within fp32")
{
    const auto metres = [](double depth) { // as OpenXR has it, of nearZ = the farthest and farZ = the nearest
        const double near = double(kMostDepth), far = double(kLeastDepth);
        return near * far / (far + depth * (near - far));
    };
    for (const float metre : {1.0f, 0.37f, 12.0f}) {
        for (float z = 0.021f; z < 5000; z *= 1.07f)
            REQUIRE(metres(double(layerDepth(z * metre, metre))) == doctest::Approx(double(z)).epsilon(1e-6));
        CHECK(layerDepth(kLeastDepth * metre, metre) == doctest::Approx(1).epsilon(1e-6));
        CHECK(layerDepth(0.001f * metre, metre) == 1);
        CHECK(layerDepth(0, metre) == 1);
        CHECK(layerDepth(kMostDepth * 1.01f * metre, metre) == 0);
        CHECK(layerDepth(std::numeric_limits<float>::infinity(), metre) == 0);
        CHECK(layerDepth(std::numeric_limits<float>::quiet_NaN(), metre) == 0);
        CHECK(layerDepth(-1, metre) == 0);
    }
}
