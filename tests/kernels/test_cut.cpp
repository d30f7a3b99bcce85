// SPDX-License-Identifier: Apache-2.0
// With the cut cache a frame selects what it selects without, whatever the camera did before.
#include "kernels/common/parallel.h"
#include "kernels/select/cut.h"
#include "tests/kernels/select_scene.h"

#include <doctest/doctest.h>

#include <limits>

using namespace gsc;
using namespace gsc::test;

namespace {

struct Selected {
    SelectScratch scratch;
    Buffer<VisibleAnchor> visible;
    SelectCounts counts{};
    size_t size = 0;

    void run(const ModelView& model, const std::vector<EyeParams>& eyes, float lod_bias, float near_z,
             const Workers& workers, CutCache* cut)
    {
        const SelectArgs args{
            &model, eyes.data(), uint32_t(eyes.size()), rasterConstants(*model.params, near_z), lod_bias, 0, cut};
        size = selectCpu(args, workers, scratch, visible, counts);
    }

    [[nodiscard]] bool sameAs(const Selected& other) const
    {
        bool same = size == other.size;
        for (size_t i = 0; i < size && same; ++i) {
            const VisibleAnchor &a = visible[i], &b = other.visible[i];
            same = a.chunk == b.chunk && a.local == b.local && a.eyes == b.eyes && a.fraction[0] == b.fraction[0] &&
                   a.fraction[1] == b.fraction[1];
        }
        for (uint32_t e = 0; e < kMaxEyes; ++e)
            same &= counts.anchors_visible[e] == other.counts.anchors_visible[e];
        return same;
    }

    [[nodiscard]] uint64_t kept() const { return counts.groups_kept[0] + counts.groups_kept[1]; }
    [[nodiscard]] uint64_t tested() const { return counts.groups_tested[0] + counts.groups_tested[1]; }
};

} // namespace

TEST_CASE("walks, turns, trembling, jumps, every LOD rule and rasteriser, narrow and wide: the uncached set")
{
    Random random(3);
    const Workers one(1), three(3);
    for (const RasterRules raster : {RasterRules::DiffGaussian, RasterRules::Gsplat})
        for (const LevelRule rule :
             {LevelRule::None, LevelRule::Floor, LevelRule::Round, LevelRule::Ceil, LevelRule::Progressive}) {
            const SyntheticModel model(smallModel(rule, raster));
            for (const float fov : {0.2f, 1.0f, 2.2f}) {
                CAPTURE(uint32_t(rule));
                CAPTURE(fov);
                CutCache cut, cut_three;
                Selected plain, cached, threaded;
                Head head, home;
                uint64_t kept = 0, tested = 0;
                size_t wrong = 0;
                for (int frame = 0; frame < 288; ++frame) {
                    nextHead(random, frame, head, home);
                    const EyeParams eye = head.eye(fov, 300, 200);
                    std::vector<EyeParams> eyes{eye};
                    if (frame % 48 >= 24)
                        eyes.push_back(shifted(eye, 0.1f));
                    plain.run(model.view(), eyes, 0, 0, one, nullptr);
                    cached.run(model.view(), eyes, 0, 0, one, &cut);
                    threaded.run(model.view(), eyes, 0, 0, three, &cut_three);
                    wrong += !cached.sameAs(plain) || !threaded.sameAs(plain) || threaded.kept() != cached.kept();
                    kept += cached.kept();
                    tested += cached.tested();
                    REQUIRE(plain.kept() == 0);
                }
                CHECK(wrong == 0);
                CHECK(kept * 2 > tested); // of a model that is mostly within arm's reach
            }
        }
}

TEST_CASE("one kind of motion at a time, far and near: the uncached set")
{
    Random random(9);
    const Workers one(1);
    for (const LevelRule rule : {LevelRule::None, LevelRule::Floor}) {
        const SyntheticModel model(smallModel(rule, RasterRules::DiffGaussian));
        for (int walk = 0; walk < 60; ++walk) {
            CutCache cut;
            Selected plain, cached;
            Head head;
            for (float& p : head.position)
                p = random.uniform(-1, 1) * (walk % 2 ? 12.0f : 4.0f);
            head.yaw = random.uniform(0, 6.28f);
            const float step[3] = {random.uniform(-0.2f, 0.2f), random.uniform(-0.2f, 0.2f),
                                   random.uniform(-0.2f, 0.2f)};
            const float turn = random.uniform(-0.03f, 0.03f);
            size_t wrong = 0;
            for (int frame = 0; frame < 40; ++frame) {
                for (int i = 0; i < 3 && walk % 3 != 0; ++i)
                    head.position[i] += step[i];
                head.yaw += walk % 3 != 1 ? turn : 0;
                const std::vector<EyeParams> eyes{head.eye(1.2f, 640, 480)};
                plain.run(model.view(), eyes, 0, 0, one, nullptr);
                cached.run(model.view(), eyes, 0, 0, one, &cut);
                wrong += !cached.sameAs(plain);
            }
            CHECK(wrong == 0);
        }
    }
}

TEST_CASE("anchors that nothing is proven about: the uncached set")
{
    const SyntheticOptions options = unprovenModel();
    SyntheticAnchors anchors = unprovenAnchors();
    Random random(23);
    const Workers one(1);
    for (const bool rotated : {false, true}) {
        for (size_t i = 0; rotated && i < 4 * anchors.count(); ++i)
            anchors.rotation.push_back(random.normal());
        const SyntheticModel model(syntheticParams(options), anchors, randomMlps(options), {}, 0);
        CutCache cut;
        Selected plain, cached;
        Head head, home;
        size_t wrong = 0;
        for (int frame = 0; frame < 300; ++frame) {
            nextHead(random, frame, head, home);
            const std::vector<EyeParams> eyes{head.eye(1.0f, 300, 200)};
            plain.run(model.view(), eyes, 0, 0, one, nullptr);
            cached.run(model.view(), eyes, 0, 0, one, &cut);
            wrong += !cached.sameAs(plain);
        }
        CHECK(wrong == 0);
    }
}

TEST_CASE("far from the origin, where coordinates are coarse: the uncached set")
{
    const Workers one(1);
    for (const LevelRule rule : {LevelRule::None, LevelRule::Round}) {
        SyntheticOptions options = smallModel(rule, RasterRules::DiffGaussian);
        options.encoding = PositionEncoding::Float;
        SyntheticAnchors anchors = randomAnchors(options);
        constexpr float kFar[3] = {3000, -700, 9000};
        for (size_t i = 0; i < anchors.position.size(); ++i)
            anchors.position[i] += kFar[i % 3];
        const SyntheticModel model(syntheticParams(options), anchors, randomMlps(options), {}, 0);
        Random random(4);
        CutCache cut;
        Selected plain, cached;
        Head head, home;
        size_t wrong = 0, visible = 0;
        for (int frame = 0; frame < 600; ++frame) {
            nextHead(random, frame, head, home);
            Head there = head;
            for (int i = 0; i < 3; ++i)
                there.position[i] += kFar[i];
            const std::vector<EyeParams> eyes{there.eye(1.0f, 300, 200)};
            plain.run(model.view(), eyes, 0, 0, one, nullptr);
            cached.run(model.view(), eyes, 0, 0, one, &cut);
            wrong += !cached.sameAs(plain);
            visible += plain.size;
        }
        CHECK(wrong == 0);
        CHECK(visible > 10000);
    }
}

TEST_CASE("size, field of view, near plane, LOD bias and view matrices that stretch: outcomes do not outlive them")
{
    const SyntheticModel model(smallModel(LevelRule::Round, RasterRules::DiffGaussian));
    const Workers one(1);
    CutCache cut;
    Selected plain, cached;
    ChangingView view;
    Random random(77);
    size_t wrong = 0;
    uint64_t kept = 0;
    for (int frame = 0; frame < 600; ++frame) {
        const EyeParams eye = view.next(random, frame);
        plain.run(model.view(), {eye}, view.bias, view.near_z, one, nullptr);
        cached.run(model.view(), {eye}, view.bias, view.near_z, one, &cut);
        wrong += !cached.sameAs(plain);
        kept += cached.kept();
    }
    CHECK(wrong == 0);
    CHECK(kept > 1000);
}

TEST_CASE("a camera that stands still tests nothing; a cleared cache tests everything")
{
    const SyntheticModel model(smallModel(LevelRule::Floor, RasterRules::DiffGaussian));
    const Workers one(1);
    CutCache cut;
    Selected first, second, third;
    const std::vector<EyeParams> eyes{Head{}.eye(1, 300, 200), shifted(Head{}.eye(1, 300, 200), 0.1f)};
    first.run(model.view(), eyes, 0, 0, one, &cut);
    CHECK(first.tested() > 0);
    CHECK(first.kept() == 0);
    for (int frame = 0; frame < 200; ++frame)
        second.run(model.view(), eyes, 0, 0, one, &cut);
    CHECK(second.tested() == 0);
    CHECK(second.kept() > 0);
    CHECK(second.sameAs(first));
    cut.clear();
    third.run(model.view(), eyes, 0, 0, one, &cut);
    CHECK(third.tested() == first.tested());
    CHECK(cut.bytes() >= 2 * sizeof(CutEntry) * (model.view().params->group_count + model.view().params->chunk_count));
}

TEST_CASE("what is far from every border is kept for long")
{
    const SyntheticModel model(smallModel(LevelRule::None, RasterRules::DiffGaussian));
    const Workers one(1);
    CutCache cut;
    Selected cached;
    Head head;
    head.position[2] = -40;
    uint64_t kept = 0, tested = 0;
    for (int frame = 0; frame < 200; ++frame) {
        head.position[0] += 0.01f;
        cached.run(model.view(), {head.eye(1.2f, 300, 200)}, 0, 0, one, &cut);
        kept += cached.kept();
        tested += cached.tested();
    }
    CHECK(double(kept) > 0.95 * double(kept + tested)); // the rest are lives that ended
}
