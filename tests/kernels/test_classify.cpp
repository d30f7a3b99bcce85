// SPDX-License-Identifier: Apache-2.0
// The quick look at a group never contradicts the exact test, and settles most anchors.
#include "kernels/select/classify.h"
#include "kernels/select/select_body.h"
#include "tests/kernels/simd_targets.h"
#include "tests/kernels/synthetic_model.h"
#include "tests/support/sanitized.h"

#include <doctest/doctest.h>

using namespace gsc;
using namespace gsc::test;

namespace {

struct Tally {
    size_t wrong = 0, settled = 0, all = 0;
};

void classifyModel(const ModelView& model, const EyeParams& eye, float fade, Tally& tally)
{
    const RasterConstants rules = rasterConstants(*model.params, 0);
    const EyeClassifier classifier = eyeClassifier(*model.params, eye, rules, 0, fade);
    REQUIRE(classifier.usable);
    for (uint32_t g = 0; g < model.params->group_count; ++g) {
        const GroupRecord& group = model.groups[g];
        const uint32_t first = group.anchor_first - model.chunks[group.chunk].anchor_first;
        const LodClassifier lod = lodClassifier(*model.params, model.levels[group.level_index].level, 0, fade);
        GroupLanes lanes{};
        lanes.count = group.anchor_count;
        for (uint32_t i = 0; i < lanes.count; ++i) {
            const Vec3<float> p = anchorPosition(model, group.chunk, first + i);
            const float* scale = model.arrays[group.chunk].scale + size_t(6) * (first + i);
            lanes.x[i] = p.x;
            lanes.y[i] = p.y;
            lanes.z[i] = p.z;
            lanes.log_sigma[i] = maxNumber(scale[0], maxNumber(scale[1], scale[2]));
            lanes.extra_level[i] = anchorExtraLevel(model, group.chunk, first + i);
        }
        Classes classes{};
        classifyGroup(classifier, lod, lanes, classes);
        for (uint32_t i = 0; i < lanes.count; ++i) {
            const bool hidden = classes.hidden[i / 64] >> i % 64 & 1, visible = classes.visible[i / 64] >> i % 64 & 1;
            const bool exact = testAnchor<float>(model, eye, rules, 0, fade, group.chunk, first + i, lod.shift).visible;
            tally.wrong += (hidden && exact) || (visible && !exact) || (hidden && visible);
            tally.settled += hidden || visible;
            ++tally.all;
        }
    }
}

} // namespace

TEST_CASE("quick classes agree with the exact test for every rule and instruction set")
{
    forEachTarget([](const char* target) {
        CAPTURE(target);
        Random random(5);
        for (const RasterRules raster : {RasterRules::DiffGaussian, RasterRules::Gsplat})
            for (const LevelRule rule :
                 {LevelRule::None, LevelRule::Floor, LevelRule::Round, LevelRule::Ceil, LevelRule::Progressive}) {
                SyntheticOptions options = octree(rule, 4000, 1);
                options.feat_dim = 4;
                options.n_offsets = 1;
                options.raster_rules = raster;
                const SyntheticModel model(options);
                Tally tally;
                for (int i = 0; i < casesOf(6); ++i) {
                    const float position[3] = {random.uniform(-6, 6), random.uniform(-6, 6), random.uniform(-6, 6)};
                    const float look_at[3] = {random.uniform(-2, 2), random.uniform(-2, 2), random.uniform(-2, 2)};
                    classifyModel(model.view(), lookAt(position, look_at, random.uniform(0.3f, 2), 213, 117),
                                  i % 3 == 0 ? 0.0f : 0.5f * float(i % 3), tally);
                }
                CHECK(tally.wrong == 0);
                CHECK(tally.settled > tally.all * 8 / 10);
            }
    });
}
