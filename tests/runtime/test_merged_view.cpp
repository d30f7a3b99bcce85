// SPDX-License-Identifier: Apache-2.0
// The merged frustum loses nothing that either eye sees, whatever the eyes are.
#include "kernels/math/anchor.h"
#include "kernels/select/select.h"
#include "runtime/view/stereo.h"
#include "tests/runtime/eye_pairs.h"

#include <doctest/doctest.h>

using namespace gsc;
using namespace gsc::test;

namespace {

constexpr double kNear = 0.05;

struct Point {
    double x[3];
};

// A point of the eye's frustum: on its border as often as not, and as often as not at the near plane.
Point pointSeen(const EyeParams64& eye, Random& random)
{
    const auto place = [&] {
        const float u = random.uniform(-1.5f, 1.5f);
        return double(std::clamp(u, -1.0f, 1.0f));
    };
    const double z = kNear * std::exp(std::max(0.0, double(random.uniform(-8, 8))));
    const double t[3] = {z * (eye.tan_mid_x + place() * eye.tan_fov_x), z * (eye.tan_mid_y + place() * eye.tan_fov_y),
                         z};
    Point point{};
    for (int c = 0; c < 3; ++c)
        point.x[c] = eye.center[c] + eye.world_to_view[c] * t[0] + eye.world_to_view[4 + c] * t[1] +
                     eye.world_to_view[8 + c] * t[2];
    return point;
}

// `scale` of the frustum's width and height.
bool holds(const MergedView& view, const EyeParams64& eye, const Point& p, double scale)
{
    double t[3];
    for (int r = 0; r < 3; ++r) {
        const double* m = eye.world_to_view + 4 * r;
        t[r] = m[0] * p.x[0] + m[1] * p.x[1] + m[2] * p.x[2] + m[3];
    }
    return t[2] >= view.near_z && std::abs(t[0] - eye.tan_mid_x * t[2]) <= scale * eye.tan_fov_x * t[2] &&
           std::abs(t[1] - eye.tan_mid_y * t[2]) <= scale * eye.tan_fov_y * t[2];
}

} // namespace

TEST_CASE("every point that either eye of a random pair sees is in the merged frustum, and it is tight")
{
    Random random(3);
    int merged = 0, refused = 0, loose = 0;
    bool all_inside = true;
    for (int pair = 0; pair < 4000; ++pair) {
        const Camera head = randomHead(random, pair % 2 ? 100.0f : 2.0f, 100, 100);
        const float cant = pair % 3 == 0 ? 0.0f : pair % 3 == 1 ? 0.3f : 1.5f, widest = pair % 5 == 4 ? 1.4f : 0.9f;
        const Camera left = eyeOfHead(head, randomView(random, widest, 0.1f, cant));
        const Camera right = eyeOfHead(head, randomView(random, widest, pair % 7 == 0 ? 5.0f : 0.1f, cant));
        const auto view = mergedView(left, right, kNear);
        if (!view) {
            ++refused;
            CHECK(cant + widest > 1.3f); // no cone of less than 90 degrees about the head's axis holds both
            continue;
        }
        ++merged;
        CHECK(view->near_z > 0);
        const EyeParams64 eye = eyeParams64(view->camera, {}),
                          eyes[2] = {eyeParams64(left, {}), eyeParams64(right, {})};
        bool lost_when_narrower = false;
        for (int i = 0; i < 250; ++i) {
            const Point p = pointSeen(eyes[i % 2], random);
            all_inside &= holds(*view, eye, p, 1);
            lost_when_narrower |= !holds(*view, eye, p, 0.99);
        }
        loose += !lost_when_narrower;
    }
    CHECK(all_inside);
    CHECK(merged > 2000);
    CHECK(refused > 10);
    CHECK(loose * 20 < merged); // some corners need more than 250 points
}

TEST_CASE("the merged camera of parallel eyes with one lens is set back by half their distance over the tangent")
{
    Random random(5);
    Camera head = randomHead(random, 3, 100, 100), left, right;
    head.fov_x = 1.2;
    head.fov_y = 0.9;
    stereoPair(head, 0.065, left, right);
    const auto view = mergedView(left, right, kNear);
    REQUIRE(view);
    const EyeParams64 middle = eyeParams64(head, {}), merged = eyeParams64(view->camera, {});
    CHECK(view->camera.fov_x == doctest::Approx(1.2));
    CHECK(view->camera.fov_y == doctest::Approx(0.9));
    CHECK(std::abs(view->camera.tan_mid_x) < 1e-8);
    const double back = 0.065 / (2 * std::tan(0.6));
    for (int c = 0; c < 3; ++c) {
        CHECK(merged.center[c] == doctest::Approx(middle.center[c] - back * head.rotation[3 * c + 2]));
        for (int r = 0; r < 3; ++r)
            CHECK(merged.world_to_view[4 * r + c] == doctest::Approx(middle.world_to_view[4 * r + c]));
    }
    CHECK(view->near_z == doctest::Approx(kNear + back));
}

TEST_CASE("eyes that look apart have no merged frustum; the widest that has one is found")
{
    Camera left, right;
    left.fov_x = right.fov_x = left.fov_y = right.fov_y = 1.0;
    const auto turned = [&](double angle) {
        Camera camera = right;
        camera.rotation[0] = camera.rotation[8] = std::cos(angle);
        camera.rotation[2] = std::sin(angle);
        camera.rotation[6] = -std::sin(angle);
        return camera;
    };
    CHECK(mergedView(left, turned(0.5), kNear));
    CHECK(mergedView(left, turned(2.1), kNear)); // 1 + 2.1 radians are less than 180 degrees
    CHECK_FALSE(mergedView(left, turned(2.2), kNear));
    CHECK_FALSE(mergedView(left, turned(3.1), kNear));
}

TEST_CASE("every anchor that either eye selects passes the merged bounds")
{
    Random random(7);
    size_t visible = 0, lost = 0, rejected = 0, tested = 0;
    for (const RasterRules raster : {RasterRules::DiffGaussian, RasterRules::Gsplat})
        for (const float log_scale : {-4.0f, -2.5f, -1.0f}) {
            SyntheticOptions options;
            options.anchors = 2000;
            options.n_offsets = 1;
            options.feat_dim = 4;
            options.raster_rules = raster;
            options.log_scale = log_scale;
            const SyntheticModel model(options);
            const ModelView& view = model.view();
            const RasterConstants rules = rasterConstants(*view.params, 0);
            for (int pair = 0; pair < 60; ++pair) {
                const uint32_t width = 20 + uint32_t(random.uniform() * 400), height = 20 + width / 2;
                const Camera head = randomHead(random, pair % 3 == 2 ? 12.0f : 4.0f, width, height);
                const float cant = pair % 2 ? 0.0f : 0.4f;
                EyeParams eyes[2];
                for (EyeParams& eye : eyes)
                    eye = eyeParams(eyeOfHead(head, randomView(random, 0.8f, 0.2f, cant)), {});
                const auto bounds = mergedBounds(eyes[0], eyes[1], rules);
                if (!bounds)
                    continue;
                const auto rejects = [&](uint32_t chunk, uint32_t local) {
                    const Vec3<float> p = anchorPosition(view, chunk, local);
                    const float* scale = view.arrays[chunk].scale + size_t(6) * local;
                    const float at[3] = {p.x, p.y, p.z};
                    return rejectsBox(*bounds, at, at, std::exp(std::max({scale[0], scale[1], scale[2]})));
                };
                for (const EyeParams& eye : eyes)
                    for (const auto& anchor : selectReference<float>(view, eye, rules, 0)) {
                        ++visible;
                        lost += rejects(anchor.chunk, anchor.local);
                    }
                for (uint32_t chunk = 0; chunk < view.params->chunk_count; ++chunk)
                    for (uint32_t local = 0; local < view.chunks[chunk].anchor_count; ++local) {
                        ++tested;
                        rejected += rejects(chunk, local);
                    }
            }
        }
    CHECK(visible > 50000);
    CHECK(lost == 0);
    CHECK(rejected > tested / 4); // and it does cut
}
