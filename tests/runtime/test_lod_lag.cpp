// SPDX-License-Identifier: Apache-2.0
// Levels that lag behind the camera: how far, that a tremble switches nothing, and that nothing else changes.
#include <gsc/error.h>
#include "kernels/math/lod.h"
#include "kernels/select/select.h"
#include "runtime/view/lod_lag.h"
#include "tests/kernels/render_tools.h"
#include "tests/kernels/synthetic_model.h"

#include <doctest/doctest.h>

#include <cmath>

using namespace gsc;
using namespace gsc::test;

namespace {

SyntheticOptions smallOctree(LevelRule rule)
{
    SyntheticOptions options = octree(rule, 3000);
    options.n_offsets = 2;
    options.feat_dim = 4;
    options.seed = 1;
    return options;
}

EyeParams eyeAt(float x, float y, float z)
{
    const float position[3] = {x, y, z}, target[3] = {x, y - 0.3f, z + 4};
    return lookAt(position, target, 1.2f, 120, 90);
}

FrameOptions lagging(float levels)
{
    FrameOptions options;
    options.lod_hysteresis = levels;
    return options;
}

float apart(const float* a, const float* b)
{
    return std::hypot(std::hypot(a[0] - b[0], a[1] - b[1]), a[2] - b[2]);
}

// Visible anchors of one eye as the flat pass sees them.
std::vector<uint64_t> seen(const ModelView& model, const EyeParams& eye, float bias = 0)
{
    std::vector<uint64_t> keys;
    for (const auto& anchor : selectReference<float>(model, eye, rasterConstants(*model.params, 0), bias))
        keys.push_back(uint64_t(anchor.chunk) << 32 | anchor.local);
    return keys;
}

// Anchors in one list and not in the other; both ascend.
size_t changed(const std::vector<uint64_t>& a, const std::vector<uint64_t>& b)
{
    size_t i = 0, j = 0, count = 0;
    while (i < a.size() || j < b.size())
        if (j == b.size() || (i < a.size() && a[i] < b[j])) {
            ++i;
            ++count;
        } else if (i == a.size() || b[j] < a[i]) {
            ++j;
            ++count;
        } else {
            ++i;
            ++j;
        }
    return count;
}

} // namespace

TEST_CASE("no leash without hysteresis, without levels, or where there is one level")
{
    SyntheticModel model(smallOctree(LevelRule::Round));
    CHECK(lodLeash(model.view(), lagging(0)) == 0);
    CHECK(lodLeash(model.view(), lagging(0.5f)) > 0);
    model.params().level_clamp = 0;
    CHECK(lodLeash(model.view(), lagging(0.5f)) == 0);
    const SyntheticModel flat(SyntheticOptions{});
    CHECK(lodLeash(flat.view(), lagging(0.5f)) == 0);
    LodLag lag;
    const EyeParams eye = eyeAt(1, 2, 3);
    EyeParams chosen{};
    for (int i = 0; i < 2; ++i) {
        lag.follow(flat.view(), lagging(0.5f), &eye, 1, &chosen);
        CHECK(std::equal(eye.center, eye.center + 3, chosen.center));
    }
}

TEST_CASE("the predicted level is off by at most the hysteresis wherever it decides")
{
    Random random(9);
    for (const LevelRule rule : {LevelRule::Floor, LevelRule::Round, LevelRule::Ceil, LevelRule::Progressive})
        for (const float bias : {0.0f, -0.6f}) {
            CAPTURE(int(rule));
            const SyntheticModel model(smallOctree(rule));
            const ModelParams& params = *model.view().params;
            FrameOptions options = lagging(0.3f);
            options.lod_bias = bias;
            LodLag lag;
            size_t different = 0;
            for (int i = 0; i < 60; ++i) {
                const EyeParams eye =
                    eyeAt(random.uniform(-3, 3), random.uniform(-3, 3), random.uniform(-6, 3)); // jumps
                EyeParams chosen{};
                lag.follow(model.view(), options, &eye, 1, &chosen);
                CHECK(apart(chosen.center, eye.center) <= lodLeash(model.view(), options) * 1.0001f);
                CHECK(std::equal(eye.world_to_view, eye.world_to_view + 12, chosen.world_to_view));
                for (int p = 0; p < 200; ++p) {
                    const Vec3<float> point{random.uniform(-4, 4), random.uniform(-4, 4), random.uniform(-4, 4)};
                    const auto level = [&](const float* center, float more) {
                        const float predicted = predictedLevel<float>(params, point, 0, center, 0, bias + more);
                        return chooseLevel(rule, predicted, params.level_clamp).level;
                    };
                    const int32_t now = level(chosen.center, 0);
                    CHECK(now >= level(eye.center, -0.301f));
                    CHECK(now <= level(eye.center, 0.301f));
                    different += now != level(eye.center, 0);
                }
            }
            CHECK(different > 20);
        }
}

TEST_CASE("a tremble switches no level, a walk switches all of them, and the way back lags")
{
    const SyntheticModel model(smallOctree(LevelRule::Round));
    const FrameOptions options = lagging(0.2f);
    const float leash = lodLeash(model.view(), options);
    REQUIRE(leash > 0.01f);
    LodLag lag;
    size_t hard = 0, soft = 0;
    std::vector<uint64_t> hard_before, soft_before;
    const EyeParams still = eyeAt(0, 0, -5);
    for (int i = 0; i < 30; ++i) {
        EyeParams eye = still, chosen{}; // the same view, so that only levels change
        eye.center[2] += 0.9f * leash * std::sin(1.7f * float(i));
        lag.follow(model.view(), options, &eye, 1, &chosen);
        const auto hard_now = seen(model.view(), eye), soft_now = seen(model.view(), chosen);
        if (i > 5) {
            hard += changed(hard_before, hard_now);
            soft += changed(soft_before, soft_now);
        }
        hard_before = hard_now;
        soft_before = soft_now;
    }
    CHECK(hard > 50);
    CHECK(soft == 0);

    // there and back: the place is a leash behind either way
    EyeParams eye = still, chosen{};
    lag.clear();
    for (int i = 0; i <= 40; ++i) {
        eye.center[2] = still.center[2] + float(i) * 0.25f * leash;
        lag.follow(model.view(), options, &eye, 1, &chosen);
    }
    CHECK(eye.center[2] - chosen.center[2] == doctest::Approx(leash).epsilon(1e-3));
    for (int i = 40; i >= 0; --i) {
        eye.center[2] = still.center[2] + float(i) * 0.25f * leash;
        lag.follow(model.view(), options, &eye, 1, &chosen);
    }
    CHECK(chosen.center[2] - eye.center[2] == doctest::Approx(leash).epsilon(1e-3));
    lag.clear();
    lag.follow(model.view(), options, &eye, 1, &chosen);
    CHECK(chosen.center[2] == eye.center[2]);
}

TEST_CASE("the place never moves further than the camera, so that what holds for a motion of the camera holds for it")
{
    const SyntheticModel model(smallOctree(LevelRule::Ceil));
    const FrameOptions options = lagging(0.5f);
    Random random(4);
    LodLag lag;
    float camera[3] = {}, place[3] = {};
    for (int i = 0; i < 300; ++i) {
        const float reach = i % 10 == 0 ? 3.0f : 0.2f;
        const EyeParams eye = eyeAt(camera[0] + random.uniform(-reach, reach), random.uniform(-1, 1), camera[2]);
        EyeParams chosen{};
        lag.follow(model.view(), options, &eye, 1, &chosen);
        if (i > 0)
            CHECK(apart(chosen.center, place) <= apart(eye.center, camera) * 1.0001f + 1e-5f);
        std::copy_n(eye.center, 3, camera);
        std::copy_n(chosen.center, 3, place);
    }
}

TEST_CASE("the backend: an eye of a pair does what it does alone, no hysteresis is upstream, caches are dropped")
{
    const SyntheticModel model(smallOctree(LevelRule::Floor));
    const auto open = [&](int threads) {
        std::unique_ptr<Renderer> backend = makeCpuRenderer(CpuPath::Fast, threads);
        backend->load(model.view());
        return backend;
    };
    const auto both = open(2), right = open(1), plain = open(1);
    FrameOptions options = lagging(0.5f);
    options.background[1] = 0.5f;
    size_t lagged = 0;
    for (int i = 0; i < 8; ++i) {
        const float z = -5 + 0.4f * float(i < 4 ? i : 8 - i);
        const std::vector<EyeParams> eyes = {eyeAt(0, 0, z), eyeAt(0.2f, 0, z)};
        const auto pair = render(*both, eyes, options);
        const auto alone = render(*right, {eyes[1]}, options);
        CHECK(pair[1].pixels == alone[0].pixels);
        FrameOptions none = options;
        none.lod_hysteresis = 0;
        const auto upstream = render(*plain, {eyes[1]}, none);
        lagged += upstream[0].pixels != alone[0].pixels;
        CHECK(upstream[0].result.eyes[0].anchors_visible == seen(model.view(), eyes[1]).size());
        if (i == 7) {
            right->dropCaches();
            CHECK(render(*right, {eyes[1]}, options)[0].pixels == upstream[0].pixels);
            CHECK(render(*right, {eyes[1]}, none)[0].pixels == upstream[0].pixels);
        }
    }
    CHECK(lagged >= 4);
    CHECK_THROWS_AS(renderWith(CpuPath::Reference, 1, model.view(), eyeAt(0, 0, -5), options), Error);
}
