// SPDX-License-Identifier: Apache-2.0
// The hierarchical selection of the CPU: the flat pass's set, exactly, for any camera and rule, and what it looks at.
#include "kernels/threads/parallel.h"
#include "kernels/select/bounds.h"
#include "kernels/select/select.h"
#include "tests/backends/selection.h"
#include "tests/support/sanitized.h"

#include <doctest/doctest.h>

#include <cmath>

using namespace gsc;
using namespace gsc::test;

namespace {

std::vector<VisibleAnchor> selectFast(const ModelView& model, const std::vector<EyeParams>& eyes, float lod_bias,
                                      float lod_fade, const Workers& workers, SelectCounts& counts)
{
    const SelectArgs args{&model,   eyes.data(), uint32_t(eyes.size()), rasterConstants(*model.params, 0),
                          lod_bias, lod_fade};
    SelectScratch scratch;
    Buffer<VisibleAnchor> visible;
    const size_t n = selectCpu(args, workers, scratch, visible, counts);
    return {visible.data(), visible.data() + n};
}

EyeParams shifted(EyeParams eye, float right)
{
    eye.world_to_view[3] -= right;
    for (int c = 0; c < 4; ++c)
        eye.full_projection[c] = eye.world_to_view[c] / eye.tan_fov_x;
    for (int c = 0; c < 3; ++c)
        eye.center[c] += right * eye.world_to_view[c];
    return eye;
}

} // namespace

// Compares eye by eye with the flat pass, one thread and two.
CheckSelection gsc::test::selectionOf(const ModelView& model)
{
    return [&model](const std::vector<EyeParams>& eyes, float lod_bias, float lod_fade) {
        static const Workers one(1), two(2);
        SelectCounts counts{}, counts_two{};
        const std::vector<VisibleAnchor> fast = selectFast(model, eyes, lod_bias, lod_fade, one, counts);
        const std::vector<VisibleAnchor> threaded = selectFast(model, eyes, lod_bias, lod_fade, two, counts_two);
        REQUIRE(fast.size() == threaded.size());
        Selected selected{.listed = fast.size()};
        for (uint32_t e = 0; e < eyes.size(); ++e) {
            const auto flat =
                selectReference<float>(model, eyes[e], rasterConstants(*model.params, 0), lod_bias, lod_fade);
            size_t at = 0;
            bool same = true;
            for (size_t i = 0; i < fast.size(); ++i) {
                same &= fast[i].chunk == threaded[i].chunk && fast[i].local == threaded[i].local &&
                        fast[i].eyes == threaded[i].eyes;
                if (!(fast[i].eyes >> e & 1))
                    continue;
                same &= at < flat.size() && flat[at].chunk == fast[i].chunk && flat[at].local == fast[i].local &&
                        flat[at].fraction == fast[i].fraction[e];
                selected.fading += fast[i].fraction[e] < 1;
                ++at;
            }
            CHECK(same);
            CHECK(at == flat.size());
            CHECK(counts.anchors_visible[e] == flat.size());
            CHECK(counts_two.anchors_visible[e] == flat.size());
            selected.visible += flat.size();
            selected.groups_tested += counts.groups_tested[e];
        }
        return selected;
    };
}

TEST_CASE("every LOD rule and rasteriser, cameras inside, outside and far: the flat pass's set")
{
    size_t visible = 0;
    Random random(11);
    for (const RasterRules raster : {RasterRules::DiffGaussian, RasterRules::Gsplat})
        for (const LevelRule rule :
             {LevelRule::None, LevelRule::Floor, LevelRule::Round, LevelRule::Ceil, LevelRule::Progressive}) {
            SyntheticOptions options = octree(rule, 3000, 5 + uint32_t(rule));
            options.feat_dim = 4;
            options.n_offsets = 1;
            options.raster_rules = raster;
            const SyntheticModel model(options);
            const CheckSelection select = selectionOf(model.view());
            for (int i = 0; i < casesOf(12); ++i) {
                const EyeParams eye = randomEye(random, i % 3 == 2 ? 80.0f : 6.0f);
                visible += select({eye}, i % 4 == 3 ? 0.7f : 0.0f, 0).visible;
                visible += select({eye, shifted(eye, 0.3f)}, 0, 0).visible;
                const float lean = random.uniform(-1.5f, 1.5f), tilt = random.uniform(-1, 1);
                visible += select({offCentre(eye, lean * eye.tan_fov_x, tilt * eye.tan_fov_y),
                                   offCentre(eye, -lean * eye.tan_fov_x, 3 * tilt * eye.tan_fov_y)},
                                  0, 0)
                               .visible;
            }
        }
    CHECK(visible > 10000);
}

TEST_CASE("a smooth transition: the flat pass's set and factors for every rule and width")
{
    Random random(17);
    for (const LevelRule rule :
         {LevelRule::None, LevelRule::Floor, LevelRule::Round, LevelRule::Ceil, LevelRule::Progressive}) {
        SyntheticOptions options = octree(rule, 3000, 5 + uint32_t(rule));
        options.feat_dim = 4;
        options.n_offsets = 1;
        const SyntheticModel model(options);
        const CheckSelection select = selectionOf(model.view());
        for (const float fade : {1e-6f, 0.1f, 0.25f, 0.5f, 1.0f}) {
            CAPTURE(int(rule));
            CAPTURE(fade);
            size_t hard = 0, soft = 0, fading = 0;
            for (int i = 0; i < casesOf(8); ++i) {
                const EyeParams eye = randomEye(random, i % 3 == 2 ? 80.0f : 6.0f);
                const float bias = i % 4 == 3 ? 0.7f : 0.0f;
                hard += select({eye}, bias, 0).visible;
                const Selected faded = select({eye}, bias, fade);
                soft += faded.visible;
                fading += faded.fading;
                (void)select({eye, shifted(eye, 0.3f)}, 0, fade);
            }
            const bool fades = rule != LevelRule::None && rule != LevelRule::Progressive;
            CHECK((fades ? soft >= hard : soft == hard));
            if (fades && fade >= 0.25f) { // more is seen, and not at once
                CHECK(soft > hard);
                CHECK(fading > 100);
            }
        }
    }
}

TEST_CASE("trap 10: with the level count of the file the finest level can be out of reach, and stays so")
{
    SyntheticModel model({.anchors = 600, .levels = 3, .flags = kModelHasLevels, .level_rule = LevelRule::Round});
    const float position[3] = {0, 0, -0.5f}, target[3] = {0, 0, 4};
    const EyeParams eye = lookAt(position, target, 2, 200, 200);
    const size_t all = selectionOf(model.view())({eye}, 50, 0).visible;
    model.params().level_clamp = 1; // as if every level-0 anchor had been pruned: levels 1..3 count as 0..2
    const size_t clamped = selectionOf(model.view())({eye}, 50, 0).visible;
    CHECK(clamped < all);
    for (const auto& anchor : selectReference<float>(model.view(), eye, rasterConstants(*model.view().params, 0), 50))
        CHECK(model.view().levels[model.view().chunks[anchor.chunk].level_index].level <= 1);
}

TEST_CASE("trap 30: float and double disagree only on anchors at a boundary")
{
    const SyntheticModel model({.anchors = 20000,
                                .feat_dim = 4,
                                .n_offsets = 1,
                                .levels = 4,
                                .flags = kModelHasLevels | kModelLodHalfCell,
                                .level_rule = LevelRule::Round});
    Random random(31);
    const RasterConstants rules = rasterConstants(*model.view().params, 0);
    size_t selected = 0, differ = 0;
    for (int i = 0; i < 5; ++i) {
        const EyeParams eye = randomEye(random, 6);
        const auto single = selectReference<float>(model.view(), eye, rules, 0);
        const auto wide = selectReference<double>(model.view(), widen(eye), rules, 0);
        size_t a = 0, b = 0;
        while (a < single.size() && b < wide.size()) {
            const auto key = [](const auto& s) { return uint64_t(s.chunk) << 32 | s.local; };
            if (key(single[a]) == key(wide[b])) {
                ++a;
                ++b;
            } else {
                ++differ;
                key(single[a]) < key(wide[b]) ? ++a : ++b;
            }
        }
        selected += single.size();
    }
    CHECK(selected > 5000);
    CHECK(differ <= 3);
}

TEST_CASE("bounds reject most groups of a scene that is mostly out of sight")
{
    SyntheticOptions options{.anchors = 20000, .feat_dim = 4, .n_offsets = 1, .log_scale = -5};
    const SyntheticModel model(options);
    const float position[3] = {0, 0, 0}, target[3] = {0, 0, 1};
    SelectCounts counts{};
    const Workers one(1);
    selectFast(model.view(), {lookAt(position, target, 0.6f, 200, 200)}, 0, 0, one, counts);
    CHECK(counts.anchors_visible[0] > 50);
    CHECK(counts.anchors_tested[0] < 10 * counts.anchors_visible[0] + 2000);
    CHECK(counts.anchors_tested[0] < options.anchors / 3);
}

TEST_CASE("groups are tested for an eye that may see something of their chunk, and no others")
{
    const SyntheticModel model({.anchors = 20000,
                                .feat_dim = 4,
                                .n_offsets = 1,
                                .levels = 3,
                                .flags = kModelHasLevels,
                                .level_rule = LevelRule::Round,
                                .extent = 40});
    const ModelView& view = model.view();
    REQUIRE(view.params->chunk_count > 200);
    Random random(41);
    const Workers one(1);
    uint64_t tested = 0;
    for (int i = 0; i < 20; ++i) {
        const std::vector<EyeParams> eyes = {randomEye(random, 40), randomEye(random, 40)};
        SelectCounts counts{};
        selectFast(view, eyes, 0, 0, one, counts);
        for (size_t e = 0; e < 2; ++e) {
            const EyeBounds bounds = eyeBounds(eyes[e], rasterConstants(*view.params, 0), 0, 0);
            uint64_t expected = 0;
            for (size_t c = 0; c < view.params->chunk_count; ++c) {
                const ChunkRecord& chunk = view.chunks[c];
                if (!rejectsBox(bounds, chunk.anchor_min, chunk.anchor_max, chunk.anchor_sigma_max) &&
                    !rejectsLevel(*view.params, bounds, view.levels[chunk.level_index].level, chunk.anchor_min,
                                  chunk.anchor_max, chunk.extra_level_max))
                    expected += chunk.group_count;
            }
            CHECK(counts.groups_tested[e] == expected);
            tested += expected;
        }
    }
    CHECK(tested > 0);
    CHECK(tested < 20 * view.params->group_count); // half of 20 times two eyes
}
