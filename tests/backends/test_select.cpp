// SPDX-License-Identifier: Apache-2.0
// Selection gives the set of the flat scalar pass, whatever the backend, the model, the rule and the eyes.
#include "tests/backends/selection.h"
#include "tests/support/sanitized.h"

#include <doctest/doctest.h>

#include <cmath>

using namespace gsc;
using namespace gsc::test;

namespace {

const std::vector<std::vector<EyeParams>> kCameras = {
    {eyeAt(0.4f, -5, 150, 110)},
    {eyeAt(0.4f, -5, 150, 110), eyeAt(0.7f, -5, 150, 110)},
    {eyeAt(0.2f, -1, 90, 140), eyeAt(2.4f, -3, 61, 40)}, // from within, and eyes that share little
};

SyntheticOptions small(uint32_t anchors)
{
    SyntheticOptions options{.anchors = anchors, .feat_dim = 4, .n_offsets = 1};
    return options;
}

} // namespace

TEST_CASE("select: anchors around a group of 128, one and two eyes")
{
    for (const uint32_t anchors : {1u, 127u, 128u, 129u, 257u}) {
        CAPTURE(anchors);
        SyntheticOptions options = small(anchors);
        options.extent = 1; // in one chunk, whose last group is the only short one
        options.seed = anchors;
        const SyntheticModel model(options);
        const CheckSelection select = selectionOf(model.view());
        size_t listed = 0;
        for (const auto& eyes : kCameras)
            listed += select(eyes, 0, 0).listed;
        CHECK(listed > 0);
    }
}

TEST_CASE("select: every level rule, both rasterisers, biased levels, smooth transitions")
{
    for (const RasterRules raster : {RasterRules::DiffGaussian, RasterRules::Gsplat})
        for (const LevelRule rule :
             {LevelRule::None, LevelRule::Floor, LevelRule::Round, LevelRule::Ceil, LevelRule::Progressive}) {
            CAPTURE(uint32_t(raster));
            CAPTURE(uint32_t(rule));
            SyntheticOptions options = small(3000);
            options.raster_rules = raster;
            options.level_rule = rule;
            options.levels = 4;
            options.flags = rule == LevelRule::Ceil ? uint32_t(kModelHasLevels) : kModelHasLevels | kModelLodHalfCell;
            options.seed = 70 + uint32_t(rule);
            const SyntheticModel model(options);
            const CheckSelection select = selectionOf(model.view());
            size_t listed = 0;
            for (const auto& eyes : kCameras)
                for (const float fade : {0.0f, 0.25f, 1.0f})
                    listed += select(eyes, eyes.size() == 1 ? 0.7f : 0.0f, fade).listed;
            CHECK(listed > 300);
        }
}

TEST_CASE("select: rotations, float positions, degenerate anchors, a scene out of sight")
{
    SyntheticOptions options = small(700);
    options.encoding = PositionEncoding::Float;
    SyntheticAnchors anchors = randomAnchors(options);
    Random random(23);
    for (size_t i = 0; i < 4 * anchors.count(); ++i)
        anchors.rotation.push_back(i / 4 % 50 == 0 ? 0.0f : random.normal());
    for (size_t i = 0; i < 6; ++i) {
        anchors.scale[6 * 10 + i] = -INFINITY; // trap 15
        anchors.scale[6 * 20 + i] = 30;        // far larger than the scene
    }
    for (size_t i = 0; i < 700; i += 9)
        anchors.scale[6 * i + i % 3] = NAN; // trap 18: never visible
    const SyntheticModel model(syntheticParams(options), anchors, randomMlps(options), {}, 0);
    const CheckSelection select = selectionOf(model.view());
    for (const auto& eyes : kCameras)
        CHECK(select(eyes, 0, 0).listed > 50);
    size_t visible = 0;
    for (int i = 0; i < casesOf(40); ++i)
        visible += select({randomEye(random, i % 2 ? 6.0f : 40.0f)}, 0, 0).visible;
    CHECK(visible > 1000);
    options.encoding = PositionEncoding::Grid;
    const SyntheticModel plain(options);
    const float position[3] = {0, 0, -60}, away[3] = {0, 0, -90};
    const Selected nothing = selectionOf(plain.view())({lookAt(position, away, 1, 50, 40)}, 0, 0);
    CHECK(nothing.listed == 0);
    CHECK(nothing.groups_tested == 0); // its chunks already are out of sight
}

TEST_CASE("select: many chunks, any pair of eyes, levels and fades: no chunk is left out that has a visible anchor")
{
    Random random(57);
    for (const LevelRule rule : {LevelRule::None, LevelRule::Ceil, LevelRule::Progressive}) {
        CAPTURE(uint32_t(rule));
        SyntheticOptions options = small(6000);
        options.level_rule = rule;
        options.levels = rule == LevelRule::None ? 1 : 3;
        options.flags = rule == LevelRule::None ? 0 : kModelHasLevels | kModelLodHalfCell;
        options.extent = rule == LevelRule::None ? 110 : 40;
        options.log_scale = -2;
        options.seed = 90 + uint32_t(rule);
        const SyntheticModel model(options);
        const ModelParams& params = *model.view().params;
        // a warp of a GPU that is tested with two processors has several runs, without levels more than it has lanes for
        REQUIRE(params.chunk_count > (rule == LevelRule::None ? 2048 : 128));
        const CheckSelection select = selectionOf(model.view());
        uint64_t listed = 0, tested = 0, tests = 0;
        for (int i = 0; i < 6; ++i) {
            const EyeParams eye = randomEye(random, i % 3 == 2 ? 150.0f : 40.0f);
            const float lean = random.uniform(-1.5f, 1.5f);
            const std::vector<EyeParams> pairs[] = {
                {eye}, {eye, randomEye(random, 40)}, {offCentre(eye, lean * eye.tan_fov_x, 0.3f), eye}};
            for (const auto& eyes : pairs) {
                const Selected selected = select(eyes, i % 4 == 3 ? 0.7f : 0.0f, i % 2 == 0 ? 0.0f : 0.5f);
                listed += selected.listed;
                tested += selected.groups_tested;
                tests += eyes.size();
            }
        }
        CHECK(listed > 2000);
        CHECK(tested < tests * params.group_count / 3 * 2);
    }
}

TEST_CASE("select: a camera amid fine anchors that are shown from close by alone: the flat pass's set")
{
    SyntheticOptions options = small(4000);
    options.level_rule = LevelRule::Floor;
    options.levels = 4;
    options.flags = kModelHasLevels;
    options.extent = 0.5f;
    SyntheticModel model(options);
    model.params().near_z = 0.001f;
    model.params().standard_dist = 0.6f; // the finest level is shown up to an eighth of it
    const CheckSelection select = selectionOf(model.view());
    Random random(29);
    size_t visible = 0;
    for (int i = 0; i < 24; ++i)
        visible += select({randomEye(random, 0.4f)}, 0, 0).visible;
    CHECK(visible > 3000);
}

TEST_CASE("select: views that scale and shear: the flat pass's set")
{
    const SyntheticModel model({.anchors = 3000, .feat_dim = 4, .n_offsets = 1, .log_scale = -1.5f});
    const CheckSelection select = selectionOf(model.view());
    Random random(23);
    size_t visible = 0;
    for (int i = 0; i < 24; ++i) {
        EyeParams eye = randomEye(random, 12);
        const float scale = std::exp(random.uniform(-1.5f, 1.5f)), shear = random.uniform(-2, 2);
        for (int c = 0; c < 4; ++c) {
            float* w = eye.world_to_view + c;
            w[0] = scale * (w[0] + shear * w[4]);
            w[4] *= i % 3 == 0 ? scale : 1.0f;
            w[8] *= i % 3 == 1 ? scale : 1.0f;
            eye.full_projection[c] = w[0] / eye.tan_fov_x;
            eye.full_projection[4 + c] = w[4] / eye.tan_fov_y;
            eye.full_projection[8 + c] = eye.full_projection[12 + c] = w[8];
        }
        visible += select({eye}, 0, 0).visible;
    }
    CHECK(visible > 3000);
}

TEST_CASE("trap 18: anchors with NaN in position or scale are never visible")
{
    SyntheticOptions options{.anchors = 64, .encoding = PositionEncoding::Float};
    SyntheticAnchors anchors = randomAnchors(options);
    for (size_t i = 0; i < 64; i += 2)
        anchors.scale[6 * i + i % 3] = NAN;
    const SyntheticModel model(syntheticParams(options), anchors, randomMlps(options), {}, 0);
    const float position[3] = {0, 0, -20}, target[3] = {0, 0, 0};
    const EyeParams eye = lookAt(position, target, 1, 200, 200);
    CHECK(selectionOf(model.view())({eye}, 0, 0).listed == 32);
}
