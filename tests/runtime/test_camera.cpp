// SPDX-License-Identifier: Apache-2.0
#include <gsc/error.h>
#include <gsc/camera.h>
#include "tests/player/golden_cameras.h"
#include "tests/support/checkpoints.h"

#include <doctest/doctest.h>

#include <cmath>
#include <cstring>
#include <numbers>
#include <random>

using namespace gsc;

namespace {

// A rotation from three angles, row-major camera-to-world.
Camera someCamera(std::mt19937& random)
{
    const auto unit = [&] { return double(random()) / 4294967296.0; };
    const double a = 6 * unit(), b = 6 * unit(), c = 6 * unit();
    const double ca = std::cos(a), sa = std::sin(a), cb = std::cos(b), sb = std::sin(b), cc = std::cos(c),
                 sc = std::sin(c);
    Camera camera;
    const double rotation[9] = {ca * cb,
                                ca * sb * sc - sa * cc,
                                ca * sb * cc + sa * sc,
                                sa * cb,
                                sa * sb * sc + ca * cc,
                                sa * sb * cc - ca * sc,
                                -sb,
                                cb * sc,
                                cb * cc};
    std::copy_n(rotation, 9, camera.rotation);
    for (double& t : camera.translation)
        t = 10 * unit() - 5;
    camera.fov_x = 0.3 + 2 * unit();
    camera.fov_y = 0.3 + 2 * unit();
    camera.width = 640 + random() % 100;
    camera.height = 480 + random() % 100;
    return camera;
}

} // namespace

TEST_CASE("the trainers' fp32 matrices come out bit for bit on every golden camera")
{
    for (const std::string& model : test::trainedModels()) {
        for (const test::GoldenCamera& golden : test::readGoldenCameras(model)) {
            CAPTURE(model);
            CAPTURE(golden.camera.name);
            const EyeParams eye = eyeParams(golden.camera, {});
            CHECK(std::memcmp(eye.world_to_view, golden.world_to_view, sizeof(eye.world_to_view)) == 0);
            CHECK(std::memcmp(eye.full_projection, golden.full_projection, sizeof(eye.full_projection)) == 0);
            CHECK(std::memcmp(eye.center, golden.center, sizeof(eye.center)) == 0);
            CHECK(eye.width == golden.camera.width);
            CHECK(eye.focal_x == doctest::Approx(eye.width / (2 * std::tan(golden.camera.fov_x / 2))).epsilon(1e-6));
        }
    }
}

TEST_CASE("fp32 eye parameters agree with double precision")
{
    std::mt19937 random(7);
    for (int i = 0; i < 200; ++i) {
        const Camera camera = someCamera(random);
        const EyeParams eye = eyeParams(camera, {});
        const EyeParams64 exact = eyeParams64(camera, {});
        for (int k = 0; k < 12; ++k)
            CHECK(std::abs(double(eye.world_to_view[k]) - exact.world_to_view[k]) <=
                  6e-8 * std::abs(exact.world_to_view[k]) + 1e-15);
        for (int k = 0; k < 16; ++k)
            CHECK(double(eye.full_projection[k]) == doctest::Approx(exact.full_projection[k]).epsilon(1e-5));
        for (int k = 0; k < 3; ++k)
            CHECK(std::abs(double(eye.center[k]) - exact.center[k]) < 5e-6);
        CHECK(double(eye.tan_fov_x) == doctest::Approx(std::tan(camera.fov_x / 2)).epsilon(1e-6));
        CHECK(double(eye.focal_y) == doctest::Approx(exact.focal_y).epsilon(1e-6));
        // the centre maps to the origin of the view
        for (int r = 0; r < 3; ++r) {
            const double* m = exact.world_to_view + 4 * r;
            CHECK(std::abs(m[0] * exact.center[0] + m[1] * exact.center[1] + m[2] * exact.center[2] + m[3]) < 1e-12);
        }
    }
}

TEST_CASE("an eye 100 km away is the eye at the origin, if the model's origin is there too")
{
    constexpr double kThere[3] = {100e3 + 0.1, -80e3, 1e3};
    std::mt19937 random(8);
    for (int i = 0; i < 200; ++i) {
        const Camera camera = someCamera(random);
        Camera there = camera;
        for (int r = 0; r < 3; ++r)
            for (int c = 0; c < 3; ++c)
                there.translation[r] -= there.rotation[3 * c + r] * kThere[c];
        const EyeParams eye = eyeParams(there, kThere), at_origin = eyeParams(camera, {});
        const EyeParams64 wide = eyeParams64(there, kThere), wide_at_origin = eyeParams64(camera, {});
        for (int k = 0; k < 12; ++k) {
            CHECK(std::abs(eye.world_to_view[k] - at_origin.world_to_view[k]) < 1e-6f);
            CHECK(std::abs(wide.world_to_view[k] - wide_at_origin.world_to_view[k]) < 1e-9);
        }
        for (int k = 0; k < 3; ++k) {
            CHECK(std::abs(eye.center[k] - at_origin.center[k]) < 5e-6f);
            CHECK(std::abs(wide.center[k] - wide_at_origin.center[k]) < 1e-9);
        }
    }
}

TEST_CASE("a point on the axis lands in the image centre, one at the edge of the view on the border")
{
    Camera camera;
    camera.fov_x = std::numbers::pi / 2;
    camera.fov_y = std::numbers::pi / 3;
    camera.width = 100;
    camera.height = 50;
    const EyeParams eye = eyeParams(camera, {});
    const auto project = [&](double x, double y, double z, int row) {
        const float* p = eye.full_projection;
        const double w = double(p[12]) * x + double(p[13]) * y + double(p[14]) * z + double(p[15]);
        const float* q = p + 4 * row;
        return (double(q[0]) * x + double(q[1]) * y + double(q[2]) * z + double(q[3])) / w;
    };
    CHECK(project(0, 0, 4, 0) == doctest::Approx(0));
    CHECK(project(4, 0, 4, 0) == doctest::Approx(1));
    CHECK(project(0, 4 * std::tan(std::numbers::pi / 6), 4, 1) == doctest::Approx(1));
    CHECK(project(0, 0, 100, 2) == doctest::Approx(1)); // far plane
    CHECK(project(0, 0, 0.01, 2) == doctest::Approx(0).epsilon(1e-6));
}

TEST_CASE("the four borders of a lens that leans land on the borders of the image, in both precisions")
{
    std::mt19937 random(17);
    const auto between = [&](double low, double high) { return low + (high - low) * double(random()) / 4294967296.0; };
    for (int i = 0; i < 200; ++i) {
        const Camera head = someCamera(random);
        EyeView view;
        view.left = between(-1.2, 0.9);
        view.right = between(view.left + 0.1, 1.2);
        view.down = between(-1.2, 0.9);
        view.up = between(view.down + 0.1, 1.2);
        const Camera canted = someCamera(random);
        std::copy_n(canted.rotation, 9, view.rotation);
        for (double& p : view.position)
            p = between(-0.1, 0.1);
        const Camera camera = eyeOfHead(head, view);
        CHECK(camera.width == head.width);
        const EyeParams eye = eyeParams(camera, {});
        const EyeParams64 exact = eyeParams64(camera, {}), middle = eyeParams64(head, {});
        // the place is that of the head and the eye's in it
        for (int k = 0; k < 3; ++k) {
            double expected = middle.center[k];
            for (int j = 0; j < 3; ++j)
                expected += head.rotation[3 * k + j] * view.position[j];
            CHECK(exact.center[k] == doctest::Approx(expected));
        }
        CHECK(exact.focal_x == doctest::Approx(camera.width / (std::tan(view.right) - std::tan(view.left))));
        CHECK(exact.focal_y == doctest::Approx(camera.height / (std::tan(view.up) - std::tan(view.down))));
        for (const double right : {view.left, view.right})
            for (const double up : {view.down, view.up}) {
                const double ray[3] = {3 * std::tan(right), -3 * std::tan(up), 3}; // in the eye's axes
                double world[3];
                for (int k = 0; k < 3; ++k) {
                    double in_head[3];
                    for (int j = 0; j < 3; ++j)
                        in_head[j] = view.position[j] + view.rotation[3 * j] * ray[0] +
                                     view.rotation[3 * j + 1] * ray[1] + view.rotation[3 * j + 2] * ray[2];
                    world[k] = middle.center[k] + head.rotation[3 * k] * in_head[0] +
                               head.rotation[3 * k + 1] * in_head[1] + head.rotation[3 * k + 2] * in_head[2];
                }
                const auto clip = [&](const auto* m) {
                    return double(m[0]) * world[0] + double(m[1]) * world[1] + double(m[2]) * world[2] + double(m[3]);
                };
                const double x = right == view.right ? 1 : -1, y = up == view.down ? 1 : -1;
                CHECK(clip(exact.full_projection) / clip(exact.full_projection + 12) == doctest::Approx(x));
                CHECK(clip(exact.full_projection + 4) / clip(exact.full_projection + 12) == doctest::Approx(y));
                CHECK(clip(eye.full_projection) / clip(eye.full_projection + 12) == doctest::Approx(x).epsilon(1e-4));
                CHECK(clip(eye.full_projection + 4) / clip(eye.full_projection + 12) ==
                      doctest::Approx(y).epsilon(1e-4));
            }
    }
}

TEST_CASE("an eye in the middle of the head with a centred lens is the head's camera")
{
    std::mt19937 random(19);
    const Camera head = someCamera(random);
    EyeView view;
    view.right = head.fov_x / 2;
    view.left = -view.right;
    view.up = head.fov_y / 2;
    view.down = -view.up;
    view.rotation[0] = view.rotation[4] = view.rotation[8] = 1;
    const EyeParams a = eyeParams(head, {}), b = eyeParams(eyeOfHead(head, view), {});
    CHECK(b.tan_mid_x == 0);
    CHECK(b.tan_mid_y == 0);
    CHECK(std::memcmp(a.full_projection, b.full_projection, sizeof(a.full_projection)) == 0);
    CHECK(a.focal_x == doctest::Approx(b.focal_x));
}

TEST_CASE("the eyes of a stereo pair lie ipd apart along the right axis, the left one on the left")
{
    std::mt19937 random(11);
    for (int i = 0; i < 50; ++i) {
        const Camera camera = someCamera(random);
        Camera left, right;
        stereoPair(camera, 0.065, left, right);
        const EyeParams64 middle = eyeParams64(camera, {}), l = eyeParams64(left, {}), r = eyeParams64(right, {});
        for (int k = 0; k < 3; ++k) {
            const double right_axis = camera.rotation[3 * k];
            CHECK(r.center[k] - l.center[k] == doctest::Approx(0.065 * right_axis));
            CHECK((r.center[k] + l.center[k]) / 2 == doctest::Approx(middle.center[k]));
        }
        // a point ahead of the camera is seen further right by the left eye: disparity has the right sign
        double ahead[3];
        for (int k = 0; k < 3; ++k)
            ahead[k] = middle.center[k] + 2 * camera.rotation[3 * k + 2];
        const auto viewX = [&](const EyeParams64& eye) {
            return eye.world_to_view[0] * ahead[0] + eye.world_to_view[1] * ahead[1] + eye.world_to_view[2] * ahead[2] +
                   eye.world_to_view[3];
        };
        CHECK(viewX(l) == doctest::Approx(0.0325));
        CHECK(viewX(r) == doctest::Approx(-0.0325));
        CHECK(left.fov_x == camera.fov_x);
        CHECK(right.width == camera.width);
    }
}

TEST_CASE("finishCamera keeps pixels square and says what is missing")
{
    Camera camera;
    camera.name = "c";
    CHECK_THROWS_AS(finishCamera(camera, 0, 0, 0), Error);   // no size
    CHECK_THROWS_AS(finishCamera(camera, 10, 10, 0), Error); // no angle
    finishCamera(camera, 200, 100, std::numbers::pi / 2);
    CHECK(camera.width == 200);
    CHECK(std::tan(camera.fov_y / 2) == doctest::Approx(0.5));

    SUBCASE("the camera's own size and angle stay as they are")
    {
        const double fov_y = camera.fov_y = 0.7; // not square, as upstream's truncated sizes are
        finishCamera(camera, 0, 0, 0);
        CHECK(camera.fov_y == fov_y);
        CHECK(camera.width == 200);
    }
    SUBCASE("another size of the same aspect keeps both angles")
    {
        const double fov_y = camera.fov_y = 0.7;
        finishCamera(camera, 2000, 1000, 0);
        CHECK(camera.fov_y == fov_y);
        CHECK(camera.height == 1000);
    }
    SUBCASE("a taller picture shows more above and below")
    {
        finishCamera(camera, 200, 200, 0);
        CHECK(std::tan(camera.fov_y / 2) == doctest::Approx(1.0));
        CHECK(std::tan(camera.fov_x / 2) == doctest::Approx(1.0));
    }
    SUBCASE("a flatter picture shows more on the left and the right, a stated angle holds")
    {
        Camera stated = camera;
        finishCamera(camera, 400, 100, 0);
        CHECK(std::tan(camera.fov_x / 2) == doctest::Approx(2.0));
        CHECK(std::tan(camera.fov_y / 2) == doctest::Approx(0.5));
        finishCamera(stated, 400, 100, std::numbers::pi / 2);
        CHECK(std::tan(stated.fov_x / 2) == doctest::Approx(1.0));
        CHECK(std::tan(stated.fov_y / 2) == doctest::Approx(0.25));
    }
    SUBCASE("one side gives the other")
    {
        const double fov_x = camera.fov_x, fov_y = camera.fov_y = 0.7;
        finishCamera(camera, 0, 50, 0);
        CHECK(camera.width == 100);
        finishCamera(camera, 333, 0, 0);
        CHECK(camera.height == 167);
        CHECK(camera.fov_x == fov_x);
        CHECK(camera.fov_y == fov_y);
    }
    SUBCASE("a focal length belongs to the file's size, or to the one asked for")
    {
        Camera lens;
        lens.focal_x = 100;
        lens.focal_y = 100;
        finishCamera(lens, 200, 100, 0);
        CHECK(std::tan(lens.fov_x / 2) == doctest::Approx(1.0));
        CHECK(std::tan(lens.fov_y / 2) == doctest::Approx(0.5));
    }
    SUBCASE("a vertical angle alone gives the horizontal one")
    {
        Camera tall;
        tall.fov_y = std::numbers::pi / 2;
        finishCamera(tall, 300, 100, 0);
        CHECK(std::tan(tall.fov_x / 2) == doctest::Approx(3.0));
    }
}
