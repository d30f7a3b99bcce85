// SPDX-License-Identifier: Apache-2.0
// Analytic cases of the arithmetic and of the traps of the format facts that live in it.
#include "kernels/math/blend.h"
#include "kernels/math/lod.h"
#include "kernels/math/projection.h"
#include "kernels/select/select_body.h"
#include "tests/kernels/synthetic_model.h"

#include <doctest/doctest.h>

#include <array>
#include <limits>
#include <random>

using namespace gsc;
using namespace gsc::test;

namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInf = std::numeric_limits<float>::infinity();

// Looks along +z from the origin, 90 degrees wide, square.
EyeParams axisEye(uint32_t size)
{
    const float position[3] = {0, 0, 0}, target[3] = {0, 0, 1};
    return lookAt(position, target, 1.57079633f, size, size);
}

Footprint<float> project(const EyeParams& eye, RasterRules rules, Vec3<float> p, float sx, float sy, float sz,
                         std::array<float, 4> q = {1, 0, 0, 0})
{
    const float scale[3] = {sx, sy, sz};
    return footprint<float>(eye, rulesOf(rules), p, scale, q.data());
}

} // namespace

TEST_CASE("trap 13: grid positions are rounded twice, a fused multiply-add would differ")
{
    std::mt19937 random(7);
    int differs = 0;
    for (int i = 0; i < 1000; ++i) {
        const int32_t k = int32_t(random() % 8000);
        const float v = 0.01783736f, origin = -57.88737869262695f;
        const float expected = float(double(float(double(k) * double(v))) + double(origin));
        CHECK(gridCoordinate(k, v, origin, false) == expected);
        differs += std::fma(float(k), v, origin) != expected;
    }
    CHECK(differs > 100);
    CHECK(std::signbit(gridCoordinate(0, 0.5f, 0.0f, true)));
}

TEST_CASE("trap 15: a scale of -inf is a point, drawn as the low-pass blob")
{
    const EyeParams eye = axisEye(64);
    const float zero = std::exp(-kInf);
    const Footprint<float> f = project(eye, RasterRules::DiffGaussian, {0, 0, 2}, zero, zero, zero);
    CHECK(f.visible);
    CHECK(f.radius == 3);
    CHECK(f.cov.a == 0.3f);
    CHECK(f.conic[0] == doctest::Approx(1 / 0.3));
    CHECK(project(eye, RasterRules::Gsplat, {0, 0, 2}, zero, zero, zero).radius == 2);
}

TEST_CASE("trap 16: a zero quaternion is no rotation, and gsplat culls it")
{
    const EyeParams eye = axisEye(64);
    float q[4] = {0, 0, 0, 0};
    normalizeQuaternion(q);
    CHECK(q[0] == 0.0f);
    const Footprint<float> zero =
        project(eye, RasterRules::DiffGaussian, {0.1f, 0.2f, 2}, 0.1f, 0.2f, 0.3f, {0, 0, 0, 0});
    const Footprint<float> identity = project(eye, RasterRules::DiffGaussian, {0.1f, 0.2f, 2}, 0.1f, 0.2f, 0.3f);
    CHECK(zero.visible);
    CHECK(zero.cov.a == identity.cov.a);
    CHECK(zero.cov.b == identity.cov.b);
    CHECK_FALSE(project(eye, RasterRules::Gsplat, {0.1f, 0.2f, 2}, 0.1f, 0.2f, 0.3f, {0, 0, 0, 0}).visible);
}

TEST_CASE("trap 18: NaN in a position or scale has radius 0")
{
    const EyeParams eye = axisEye(64);
    CHECK_FALSE(project(eye, RasterRules::DiffGaussian, {kNan, 0, 2}, 0.1f, 0.1f, 0.1f).visible);
    CHECK_FALSE(project(eye, RasterRules::DiffGaussian, {0, 0, kNan}, 0.1f, 0.1f, 0.1f).visible);
    CHECK_FALSE(project(eye, RasterRules::DiffGaussian, {0, 0, 2}, kNan, 0.1f, 0.1f).visible);
}

TEST_CASE("trap 19: an infinite covariance saturates the radius and is flagged as not finite")
{
    const EyeParams eye = axisEye(64);
    CHECK_FALSE(project(eye, RasterRules::DiffGaussian, {0, 0, 2}, 1e25f, 1e25f, 1e25f).finite);
    for (const Vec3<float> far :
         {Vec3<float>{3e38f, 0, 2}, {0, 3e38f, 2}}) // a centre that is none, a covariance that is one
        CHECK_FALSE(project(eye, RasterRules::DiffGaussian, far, 0.1f, 0.1f, 0.1f).finite);
    CHECK(splatRadius<float>({kInf, kInf, kInf}, kNan, 0.1f) == INT32_MAX);
    CHECK(splatRadius<float>({kNan, 0, 1}, kNan, 0.1f) == 0);
    // large but finite: legal, and covers the screen
    const Footprint<float> f = project(eye, RasterRules::DiffGaussian, {0, 0, 2}, 1e12f, 1e12f, 1e12f);
    CHECK(f.finite);
    CHECK(f.radius == INT32_MAX);
    CHECK(f.tiles.x0 == 0);
    CHECK(f.tiles.x1 == 4);
}

TEST_CASE("trap 20: the near plane is 0.2 inclusive, nothing is culled at the sides")
{
    const EyeParams eye = axisEye(64);
    CHECK_FALSE(project(eye, RasterRules::DiffGaussian, {0, 0, 0.2f}, 0.1f, 0.1f, 0.1f).visible);
    CHECK(project(eye, RasterRules::DiffGaussian, {0, 0, 0.21f}, 0.1f, 0.1f, 0.1f).visible);
    CHECK(project(eye, RasterRules::Gsplat, {0, 0, 0.02f}, 0.1f, 0.1f, 0.1f).visible);
    CHECK_FALSE(project(eye, RasterRules::Gsplat, {0, 0, 0.009f}, 0.1f, 0.1f, 0.1f).visible);
    // centre far outside, but the square still reaches the image
    CHECK(project(eye, RasterRules::DiffGaussian, {6, 0, 1}, 3, 3, 3).visible);
}

TEST_CASE("trap 21: only a determinant of exactly zero culls; negative ones survive, but not in gsplat")
{
    const EyeParams eye = axisEye(64);
    std::mt19937 random(3);
    int zero = 0, negative = 0;
    for (int i = 0; i < 20000; ++i) {
        // any needle, and some at 45 degrees whose sides are powers of two: fused, hardly any other gives zero
        const bool even = i < 1000;
        const float angle = even ? 0.785398f + float(i) * 0x1p-23f : float(random() >> 8) * 0x1p-24f * 3.14159f;
        const std::array<float, 4> q = {std::cos(angle / 2), 0, 0, std::sin(angle / 2)};
        const float size = even ? 0x1p20f / (1 - 2 * (q[3] * q[3])) : std::exp(float(random() >> 8) * 0x1p-24f * 12.0f);
        const Footprint<float> f = project(eye, RasterRules::DiffGaussian, {0, 0, 2}, size, 0, 0, q);
        const float det = determinant(f.cov);
        zero += det == 0;
        negative += det < 0;
        CHECK(f.visible == (det != 0));
        CHECK(project(eye, RasterRules::Gsplat, {0, 0, 2}, size, 0, 0, q).visible == (det > 0));
    }
    CHECK(zero > 0);
    CHECK(negative > 0);
}

TEST_CASE("trap 22: pixel centres are integers and the formula is evaluated in double")
{
    EyeParams eye = axisEye(64);
    const Footprint<float> middle = project(eye, RasterRules::DiffGaussian, {0, 0, 2}, 0.01f, 0.01f, 0.01f);
    CHECK(middle.x == doctest::Approx(31.5).epsilon(1e-6));
    CHECK(middle.y == doctest::Approx(31.5).epsilon(1e-6));
    eye.width = 1234567;
    float x, y;
    const Vec3<float> p{0.3f, 0, 1};
    pixelCenter<float>(eye, false, p, viewPoint<float>(eye, p), x, y);
    const float n = eye.full_projection[0] * 0.3f * (1.0f / (1.0f + 0.0000001f));
    CHECK(x == float(((double(n) + 1.0) * 1234567.0 - 1.0) * 0.5));
    CHECK(x != ((n + 1.0f) * 1234567.0f - 1.0f) * 0.5f);
}

TEST_CASE("trap 26: the rectangle is the 3-sigma square in whole tiles")
{
    const EyeParams eye = axisEye(64);
    TileRect rect = tileRect<float>(eye, false, 31.5f, 31.5f, 3);
    CHECK(rect.x0 == 1);
    CHECK(rect.x1 == 3); // 34.5 + 15 lies in the fourth tile, exclusive
    rect = tileRect<float>(eye, false, 24.0f, 24.0f, 7);
    CHECK(rect.x0 == 1);
    CHECK(rect.x1 == 2);
    CHECK(tileRect<float>(eye, false, -5.0f, 8.0f, 5).empty()); // reaches pixel 0 only from the left
    CHECK_FALSE(tileRect<float>(eye, false, -4.0f, 8.0f, 5).empty());
    CHECK(tileRect<float>(eye, false, 70.0f, 8.0f, 6).empty());
    CHECK_FALSE(tileRect<float>(eye, false, 70.0f, 8.0f, 7).empty());
    CHECK(tileRect<float>(eye, true, 15.5f, 8.0f, 2).x1 == 2); // gsplat: ceil((16 + 2) / 16)
    CHECK(tileRect<float>(eye, false, 8.0f, 8.0f, INT32_MAX).x1 == 4);
}

TEST_CASE("trap 27: alpha is capped at 0.99, or 0.999 in gsplat, and the Gaussian that crosses the stop is not drawn")
{
    const float conic[3] = {1, 0, 1}, white[3] = {1, 1, 1};
    const RasterConstants upstream = rulesOf(RasterRules::DiffGaussian), gsplat = rulesOf(RasterRules::Gsplat);
    PixelState<float> pixel{{0, 0, 0}, 1, false};
    blendStep(upstream, conic, 0.0f, 0.0f, 1.0f, white, pixel);
    CHECK(pixel.transmittance == doctest::Approx(0.01));
    blendStep(upstream, conic, 0.0f, 0.0f, 1.0f, white, pixel); // 0.01 * 0.01 is not below 1e-4 in float
    const bool second = pixel.done;
    blendStep(upstream, conic, 0.0f, 0.0f, 1.0f, white, pixel);
    CHECK(pixel.done);
    CHECK(pixel.transmittance == doctest::Approx(second ? 0.01 : 1e-4).epsilon(1e-4));
    CHECK(pixel.color[0] == doctest::Approx(1 - pixel.transmittance));
    PixelState<float> other{{0, 0, 0}, 1, false};
    blendStep(gsplat, conic, 0.0f, 0.0f, 1.0f, white, other);
    CHECK(other.transmittance == doctest::Approx(0.001));
    other = {{0, 0, 0}, 2e-4f, false};
    blendStep(upstream, conic, 0.0f, 0.0f, 0.5f, white, other);
    CHECK_FALSE(other.done);
    other = {{0, 0, 0}, 2e-4f, false};
    blendStep(gsplat, conic, 0.0f, 0.0f, 0.5f, white, other);
    CHECK(other.done); // 1e-4 itself stops there
    PixelState<float> faint{{0, 0, 0}, 1, false};
    blendStep(upstream, conic, 0.0f, 0.0f, 0.0039f, white, faint); // below 1/255
    CHECK(faint.transmittance == 1.0f);
    const float bad_conic[3] = {-1, 0, -1};
    blendStep(upstream, bad_conic, 1.0f, 0.0f, 1.0f, white, faint); // power above zero
    CHECK(faint.transmittance == 1.0f);
}

TEST_CASE("trap 29: round is half to even, and levels are clamped as floats")
{
    const auto level = [](LevelRule rule, float v, int32_t top) { return chooseLevel(rule, v, top).level; };
    CHECK(level(LevelRule::Round, 0.5f, 5) == 0);
    CHECK(level(LevelRule::Round, 1.5f, 5) == 2);
    CHECK(level(LevelRule::Round, 2.5f, 5) == 2);
    CHECK(level(LevelRule::Floor, 2.99f, 5) == 2);
    CHECK(level(LevelRule::Ceil, 2.01f, 5) == 3);
    for (const LevelRule rule : {LevelRule::Floor, LevelRule::Round, LevelRule::Ceil}) {
        CHECK(level(rule, kInf, 5) == 5);
        CHECK(level(rule, 1e30f, 5) == 5);
        CHECK(level(rule, -kInf, 5) == 0);
        CHECK(level(rule, kNan, 5) == 0);
    }
}

TEST_CASE("trap 14: dist2level progressive fades the level it chooses, from 0.9999 at both ends")
{
    LevelChoice<float> choice = chooseLevel(LevelRule::Progressive, 1.25f, 3);
    CHECK(choice.level == 2);
    CHECK(choice.fraction == doctest::Approx(0.25));
    choice = chooseLevel(LevelRule::Progressive, -4.0f, 3);
    CHECK(choice.level == 0);
    CHECK(choice.fraction == doctest::Approx(0.9999));
    choice = chooseLevel(LevelRule::Progressive, kInf, 3);
    CHECK(choice.level == 3);
    CHECK(choice.fraction == doctest::Approx(0.9999).epsilon(1e-4));
}

TEST_CASE("a smooth transition rises linearly about the place where upstream switches")
{
    for (const LevelRule rule : {LevelRule::Floor, LevelRule::Round, LevelRule::Ceil})
        for (const float fade : {0.1f, 0.5f, 1.0f}) {
            CAPTURE(int(rule));
            CAPTURE(fade);
            // what is drawn of an anchor of `level`
            const auto opacity = [&](float v, int32_t level, float width) {
                const LevelChoice<float> choice = chooseLevel(rule, v, 3, width);
                return level > choice.level ? 0.0f : level == choice.level ? choice.fraction : 1.0f;
            };
            for (int32_t level = 0; level <= 4; ++level) {
                float before = level > 0 ? 0.0f : 1.0f; // level 0 is always there
                for (float v = -3; v < 7; v += 0.01f) {
                    const float now = opacity(v, level, fade), hard = opacity(v, level, 0);
                    CHECK(now >= before);
                    CHECK(now - before <= 0.0101f / fade);
                    const float from = v - (float(level) - switchOffset(rule)); // upstream's switch
                    if (std::abs(from) > 0.5f * fade + 0.001f)
                        CHECK(now == hard);
                    else if (level > 0 && level < 4)
                        CHECK(now == doctest::Approx(0.5f + from / fade).epsilon(0.02));
                    before = now;
                }
            }
            CHECK(chooseLevel(rule, kInf, 3, fade).level == 3);
            CHECK(chooseLevel(rule, kInf, 3, fade).fraction == 1);
            CHECK(chooseLevel(rule, -kInf, 3, fade).level == 0);
            CHECK(chooseLevel(rule, kNan, 3, fade).level == 0);
            CHECK(chooseLevel(rule, kNan, 3, fade).fraction == 1);
            CHECK(chooseLevel(rule, 5.0f, 0, fade).level == 0);
        }
    CHECK(chooseLevel(LevelRule::Progressive, 1.25f, 3, 0.5f).fraction == doctest::Approx(0.25)); // has its own
}

TEST_CASE("trap 11: LOD distance is taken from the anchor plus half a cell")
{
    ModelParams params{};
    params.flags = kModelHasLevels | kModelLodHalfCell;
    params.voxel_size = 0.5f;
    params.fork = 2;
    params.standard_dist = 8;
    params.lod_scale = 1;
    CHECK(lodShift<float>(params, 1) == 0.125f);
    const float center[3] = {0.125f, 0.125f, 0.125f};
    const Vec3<float> p{4, 0, 0};
    CHECK(predictedLevel<float>(params, p, 0.125f, center, 0.25f, 0) == doctest::Approx(1.25));
    params.flags = kModelHasLevels;
    CHECK(lodShift<float>(params, 1) == 0.0f);
}

TEST_CASE("a level is that many halvings of the distance, or divisions by what the model forks into")
{
    const float center[3] = {0, 0, 0};
    for (const uint32_t fork : {2u, 3u, 4u, 10u}) {
        CAPTURE(fork);
        ModelParams params{};
        params.flags = kModelHasLevels;
        params.fork = fork;
        params.standard_dist = 8;
        params.lod_scale = 1;
        for (int level = -1; level <= 4; ++level) {
            const auto distance = float(8 / std::pow(double(fork), level));
            CHECK(predictedLevel<float>(params, {0, distance, 0}, 0, center, 0, 0) == doctest::Approx(level));
            CHECK(predictedLevel<double>(params, {0, distance, 0}, 0, widen(axisEye(8)).center, 0.5, 1) ==
                  doctest::Approx(level + 1.5));
        }
        params.lod_scale = 2; // as if all were twice as far away
        CHECK(predictedLevel<float>(params, {0, 0, 4}, 0, center, 0, 0) == doctest::Approx(0));
    }
}

TEST_CASE("gsplat draws what reaches into the image with pixel centres at halves, and culls the rest")
{
    const EyeParams eye = axisEye(64);
    int drawn = 0, culled = 0;
    for (int i = 0; i < 4000; ++i)
        for (const bool right : {false, true})
            for (const bool vertical : {false, true}) {
                const float out = (right ? 1.0f : -1.0f) * (2 + float(i) * 0.0005f);
                const Vec3<float> p = vertical ? Vec3<float>{0, out, 2} : Vec3<float>{out, 0, 2};
                const Footprint<float> f = project(eye, RasterRules::Gsplat, p, 0.05f, 0.05f, 0.05f);
                const double centre = double(vertical ? f.y : f.x) + 0.5, radius = f.radius;
                REQUIRE(radius > 0);
                const bool reaches = centre + radius > 0 && centre - radius < 64;
                if (std::fabs(centre + radius) > 1e-4 && std::fabs(centre - radius - 64) > 1e-4)
                    CHECK(f.visible == reaches);
                drawn += reaches;
                culled += !reaches;
            }
    CHECK(drawn > 500);
    CHECK(culled > 500);
}
