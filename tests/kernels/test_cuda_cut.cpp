// SPDX-License-Identifier: Apache-2.0
// With the cut cache a device selects and draws what it does without, whatever the camera did before.
#include "kernels/select/cut.h"
#include "runtime/cut_cuda.h"
#include "tests/kernels/select_scene.h"
#include "tests/kernels/gpu_stage.h"
#include "tests/kernels/reuse_tools.h"

#include "kernels/math/anchor.h"
#include "kernels/math/projection.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <limits>

using namespace gsc;
using namespace gsc::test;

namespace {

// One model's selection, frame after frame, with a cache or without.
class Selection {
public:
    explicit Selection(const StageModel& model, bool cached)
        : m_model(model), m_cached(cached), m_groups(groupCount()), m_visible(model.scene.model().anchor_count),
          m_histogram(kDepthBuckets), m_counters(1)
    {
        m_cut.prepare(groupCount(), kMaxEyes);
    }

    void run(const std::vector<EyeParams>& eyes, float lod_bias = 0, float near_z = 0)
    {
        const ModelParams& params = m_model.scene.model().params;
        m_histogram.write(std::vector<uint32_t>(kDepthBuckets, 0));
        m_counters.write({FrameCounters{}});
        WithCut<SelectCudaArgs> args{};
        args.model = m_model.scene.model();
        std::copy(eyes.begin(), eyes.end(), args.eyes);
        args.eye_count = uint32_t(eyes.size());
        args.rules = rasterConstants(params, near_z);
        args.lod_bias = lod_bias;
        args.group_count = groupCount();
        args.visible_groups = m_groups.get();
        args.visible = m_visible.get();
        args.capacity = args.model.anchor_count;
        args.histogram = m_histogram.get();
        args.counters = m_counters.get();
        if (m_cached) {
            m_cut.begin(params, eyes.data(), args.eye_count, args.rules, lod_bias, testStream());
            args.cut = m_cut.args();
            selectGroupsCuda(args, kTestProcessors, testStream().handle);
            selectAnchorsCuda(args, kTestProcessors, testStream().handle);
            selectKnownCuda(args, kTestProcessors, testStream().handle);
        } else {
            const SelectCudaArgs& plain = args;
            selectGroupsCuda(plain, kTestProcessors, testStream().handle);
            selectAnchorsCuda(plain, kTestProcessors, testStream().handle);
        }
        counters = m_counters.read()[0];
        histogram = m_histogram.read();
        visible = m_visible.read();
        visible.resize(counters.anchors_listed);
        std::sort(visible.begin(), visible.end());
        intact = m_groups.intact() && m_visible.intact() && m_histogram.intact() && m_counters.intact();
    }

    [[nodiscard]] bool sameAs(const Selection& other) const
    {
        return intact && visible == other.visible && histogram == other.histogram &&
               std::equal(counters.anchors_visible, counters.anchors_visible + kMaxEyes,
                          other.counters.anchors_visible);
    }
    [[nodiscard]] uint32_t groupCount() const { return uint32_t(m_model.scene.model().params.group_count); }
    [[nodiscard]] uint32_t kept() const { return counters.groups_kept[0] + counters.groups_kept[1]; }
    [[nodiscard]] uint32_t tested() const { return counters.anchors_tested[0] + counters.anchors_tested[1]; }
    void forget() { m_cut.forget(); }
    [[nodiscard]] uint32_t testedBy(uint32_t eye) const // groups that are looked at for it
    {
        const std::vector<uint32_t> groups = m_groups.read();
        return uint32_t(std::count_if(groups.begin(), groups.begin() + counters.groups_visible,
                                      [&](uint32_t entry) { return (entry >> kAnchorBits >> eye & 1u) != 0; }));
    }

    FrameCounters counters{};
    std::vector<uint32_t> histogram, visible;
    bool intact = false;

private:
    const StageModel& m_model;
    bool m_cached;
    MemoryBudget m_budget;
    CudaCut m_cut{m_budget};
    GuardedBuffer<uint32_t> m_groups, m_visible, m_histogram;
    GuardedBuffer<FrameCounters> m_counters;
};

SyntheticOptions cutModel(LevelRule rule, RasterRules raster)
{
    SyntheticOptions options = smallModel(rule, raster);
    options.anchors = 2500;
    return options;
}

} // namespace

TEST_CASE("cut on a device: walks, turns, trembling, jumps, every LOD rule and rasteriser: the uncached set")
{
    Random random(3);
    for (const RasterRules raster : {RasterRules::DiffGaussian, RasterRules::Gsplat})
        for (const LevelRule rule :
             {LevelRule::None, LevelRule::Floor, LevelRule::Round, LevelRule::Ceil, LevelRule::Progressive}) {
            CAPTURE(uint32_t(rule));
            const SyntheticModel synthetic(cutModel(rule, raster));
            const StageModel model(synthetic.view());
            const float fov = rule == LevelRule::None ? 2.2f : rule == LevelRule::Floor ? 0.2f : 1.0f;
            Selection plain(model, false), cached(model, true);
            Head head, home;
            uint64_t kept = 0, tests_saved = 0, all = 0;
            size_t wrong = 0;
            for (int frame = 0; frame < 96; ++frame) {
                nextHead(random, frame, head, home);
                const EyeParams eye = head.eye(fov, 300, 200);
                std::vector<EyeParams> eyes{eye};
                if (frame % 48 >= 24)
                    eyes.push_back(shifted(eye, 0.1f));
                plain.run(eyes);
                cached.run(eyes);
                wrong += !cached.sameAs(plain);
                kept += cached.kept();
                all += uint64_t(eyes.size()) * plain.groupCount();
                tests_saved += cached.tested() < plain.tested();
                REQUIRE(plain.kept() == 0);
            }
            CHECK(wrong == 0);
            CHECK(kept * 3 > all);
            CHECK(tests_saved > 24); // of 96 frames
        }
}

TEST_CASE("cut on a device: size, field of view, near plane, bias, view matrices that stretch: nothing outlives them")
{
    const SyntheticModel synthetic(cutModel(LevelRule::Round, RasterRules::DiffGaussian));
    const StageModel model(synthetic.view());
    Selection plain(model, false), cached(model, true);
    ChangingView view;
    Random random(77);
    size_t wrong = 0;
    uint64_t kept = 0;
    for (int frame = 0; frame < 240; ++frame) {
        const EyeParams eye = view.next(random, frame);
        plain.run({eye}, view.bias, view.near_z);
        cached.run({eye}, view.bias, view.near_z);
        wrong += !cached.sameAs(plain);
        kept += cached.kept();
    }
    CHECK(wrong == 0);
    CHECK(kept > 600);
}

TEST_CASE("cut on a device: anchors that nothing is proven about, rotated ones, and a scene far from the origin")
{
    constexpr float kInf = std::numeric_limits<float>::infinity(), kFar[3] = {3000, -700, 9000};
    for (const bool rotated : {false, true}) {
        const SyntheticOptions options = unprovenModel();
        SyntheticAnchors anchors = unprovenAnchors();
        for (size_t i = 0; i < anchors.position.size(); ++i)
            anchors.position[i] += rotated ? 0 : kFar[i % 3];
        Random random(23);
        for (size_t i = 0; rotated && i < 4 * anchors.count(); ++i)
            anchors.rotation.push_back(i / 4 % 50 == 0 ? kInf : random.normal());
        const SyntheticModel synthetic(syntheticParams(options), anchors, randomMlps(options), {}, 0);
        const StageModel model(synthetic.view());
        Selection plain(model, false), cached(model, true);
        Head head, home;
        size_t wrong = 0, seen = 0;
        for (int frame = 0; frame < 144; ++frame) {
            nextHead(random, frame, head, home);
            Head there = head;
            for (int i = 0; i < 3; ++i)
                there.position[i] += rotated ? 0 : kFar[i];
            const std::vector<EyeParams> eyes{there.eye(1.0f, 300, 200)};
            plain.run(eyes);
            cached.run(eyes);
            wrong += !cached.sameAs(plain);
            seen += cached.visible.size();
        }
        CHECK(wrong == 0);
        CHECK(seen > 3000);
    }
}

TEST_CASE("cut on a device: a long, slow way, for which no outcome is good to its end")
{
    const SyntheticModel synthetic(cutModel(LevelRule::Floor, RasterRules::DiffGaussian));
    const StageModel model(synthetic.view());
    Selection plain(model, false), cached(model, true);
    Head head;
    head.position[2] = -9;
    size_t wrong = 0, first_seen = 0;
    uint64_t kept = 0;
    for (int frame = 0; frame < 240; ++frame) {
        head.position[0] += 0.02f;
        head.position[2] += 0.03f;
        const std::vector<EyeParams> eyes{head.eye(0.8f, 300, 200)};
        plain.run(eyes);
        cached.run(eyes);
        wrong += !cached.sameAs(plain);
        kept += cached.kept();
        first_seen = frame == 0 ? plain.visible.size() : first_seen;
    }
    CHECK(wrong == 0);
    CHECK(plain.visible.size() * 2 < first_seen); // it has passed most of the model
    CHECK(kept * 2 > 240 * plain.groupCount());
}

TEST_CASE("cut on a device: who stands still tests nothing; a forgetful cache tests everything")
{
    const SyntheticModel synthetic(cutModel(LevelRule::Floor, RasterRules::DiffGaussian));
    const StageModel model(synthetic.view());
    Selection plain(model, false), cached(model, true);
    const std::vector<EyeParams> eyes{Head{}.eye(1, 300, 200), shifted(Head{}.eye(1, 300, 200), 0.1f)};
    plain.run(eyes);
    cached.run(eyes);
    CHECK(cached.kept() == 0);
    CHECK(cached.tested() == plain.tested());
    for (int frame = 0; frame < 80; ++frame) { // for longer than an outcome lives while the camera moves
        cached.run(eyes);
        REQUIRE(cached.sameAs(plain));
        REQUIRE(cached.kept() == 2 * cached.groupCount());
        REQUIRE(cached.tested() == 0);
    }
    // the right eye jumps: what the left one knows is tested with it where both may see something
    const std::vector<EyeParams> jumped{eyes[0], shifted(eyes[1], 2)};
    plain.run(jumped);
    cached.run(jumped);
    CHECK(cached.sameAs(plain));
    const uint32_t again = cached.testedBy(0);
    CHECK(again > 0);
    CHECK(cached.counters.groups_kept[0] == cached.groupCount() - again);
    CHECK(cached.counters.groups_kept[1] < cached.groupCount());
    cached.forget();
    plain.run(eyes);
    cached.run(eyes);
    CHECK(cached.kept() == 0);
    CHECK(cached.sameAs(plain));
}

TEST_CASE("cut: the slack of one anchor is the one that the CPU finds for a group of them")
{
    for (const RasterRules raster : {RasterRules::DiffGaussian, RasterRules::Gsplat})
        for (const LevelRule rule : {LevelRule::None, LevelRule::Floor, LevelRule::Round, LevelRule::Progressive}) {
            const SyntheticModel synthetic(smallModel(rule, raster));
            const ModelView& model = synthetic.view();
            Random random(5);
            size_t off = 0, hidden_or_visible = 0;
            for (int pose = 0; pose < 12; ++pose) {
                Head head;
                head.move(random, 4, 3);
                const EyeParams eye = head.eye(1, 300, 200);
                const EyeClassifier classifier =
                    eyeClassifier(*model.params, eye, rasterConstants(*model.params, 0), 0);
                const CutScales scales = cutScales(classifier);
                for (uint32_t g = 0; g < model.params->group_count; ++g) {
                    const GroupRecord& group = model.groups[g];
                    const LodClassifier lod = lodOf(model, group);
                    const GroupLanes lanes = lanesOf(model, group);
                    alignas(64) float slacks[kGroupSize];
                    laneSlacks(classifier, scales, lod, lanes, slacks);
                    for (uint32_t i = 0; i < lanes.count; ++i) {
                        const float slack = anchorSlack(classifier, scales, lod, {lanes.x[i], lanes.y[i], lanes.z[i]},
                                                        std::exp(lanes.log_sigma[i]), lanes.extra_level[i]);
                        off += !(std::abs(slack - slacks[i]) <= 0.01f + 0.01f * slack);
                        hidden_or_visible += slack > 0.05f;
                    }
                }
            }
            CHECK(off == 0);
            CHECK(hidden_or_visible > 10000);
        }
}

TEST_CASE("cut on a device: frames equal to the byte, with reuse, in both tiers, after all that clears it")
{
    const SyntheticModel synthetic(modelOptions(LevelRule::Floor));
    struct Case {
        Tier tier;
        ReusePolicy policy;
    };
    for (const Case& c : {Case{Tier::Fast, ReusePolicy::None}, Case{Tier::Exact, ReusePolicy::None},
                          Case{Tier::Fast, ReusePolicy::Error}, Case{Tier::Fast, ReusePolicy::Depth}}) {
        CAPTURE(int(c.tier));
        CAPTURE(int(c.policy));
        const auto plain = open(synthetic.view()), cached = open(synthetic.view());
        FrameOptions without = with(c.policy, 2);
        without.tier = c.tier;
        FrameOptions cut = without;
        cut.reuse.cut = true;
        Head head, home;
        head.position[2] = -5;
        Random random(11);
        uint64_t kept = 0;
        for (int frame = 0; frame < 16; ++frame) {
            CAPTURE(frame);
            nextHead(random, frame + 6, head, home);
            std::vector<EyeParams> eyes{head.eye(1, 96, 80)};
            if (frame >= 4)
                eyes.push_back(shifted(eyes[0], 0.1f));
            if (frame == 13)
                for (auto* backend : {plain.get(), cached.get()})
                    backend->dropCaches();
            without.lod_hysteresis = cut.lod_hysteresis = frame == 9 ? 0.5f : 0.0f; // for which it does not serve
            const auto expected = render(*plain, eyes, without), actual = render(*cached, eyes, cut);
            for (size_t e = 0; e < eyes.size(); ++e) {
                CHECK(sameBytes(expected[e].pixels, actual[e].pixels));
                CHECK(expected[0].result.eyes[e].anchors_visible == actual[0].result.eyes[e].anchors_visible);
            }
            const uint64_t groups = actual[0].result.groups_kept;
            CHECK(expected[0].result.groups_kept == 0);
            CHECK(groups <= eyes.size() * synthetic.view().params->group_count);
            if (frame == 0 || frame == 9 || frame == 10 || frame == 13)
                CHECK(groups == 0);
            CHECK(actual[0].result.cache_bytes > expected[0].result.cache_bytes);
            kept += groups;
        }
        CHECK(kept > 5 * synthetic.view().params->group_count);
    }
}

TEST_CASE("cut on a device: a frame that is drawn again is told as it was drawn first")
{
    SyntheticOptions options = modelOptions();
    options.anchors = 24000 * kManyAnchors;
    options.n_offsets = 1;
    options.log_scale = -0.4f; // more bins of every splat than there is room for at first
    const SyntheticModel synthetic(options);
    const auto plain = open(synthetic.view()), cached = open(synthetic.view());
    const FrameOptions without = with(ReusePolicy::None);
    FrameOptions cut = without;
    cut.reuse.cut = true;
    for (int frame = 0; frame < 2; ++frame) {
        const auto expected = render(*plain, walk(frame, 1), without), actual = render(*cached, walk(frame, 1), cut);
        CHECK(sameBytes(expected[0].pixels, actual[0].pixels));
        CHECK((actual[0].result.repeats > 0) == (frame == 0));
        CHECK((actual[0].result.groups_kept > 0) == (frame == 1));
        CHECK(expected[0].result.eyes[0].anchors_tested >= actual[0].result.eyes[0].anchors_tested);
        if (frame == 0)
            CHECK(expected[0].result.eyes[0].anchors_tested == actual[0].result.eyes[0].anchors_tested);
    }
}

TEST_CASE("cut on a device: another model, another bias, more eyes, and memory that is not there")
{
    const SyntheticModel first(modelOptions(LevelRule::Floor));
    SyntheticOptions larger = modelOptions(LevelRule::Round);
    larger.anchors = 2000;
    larger.seed = 19;
    const SyntheticModel second(larger);
    const auto plain = open(first.view()), cached = open(first.view());
    FrameOptions without = with(ReusePolicy::None), cut = without;
    cut.reuse.cut = true;
    const auto check = [&](size_t eye_count, float bias) { // the groups that were kept
        without.lod_bias = cut.lod_bias = bias;
        const auto expected = render(*plain, walk(0, eye_count), without),
                   actual = render(*cached, walk(0, eye_count), cut);
        for (size_t e = 0; e < eye_count; ++e)
            CHECK(sameBytes(expected[e].pixels, actual[e].pixels));
        return actual[0].result.groups_kept;
    };
    CHECK(check(1, 0) == 0);
    CHECK(check(1, 0) == first.view().params->group_count);
    CHECK(check(1, -1) == 0); // it rests
    CHECK(check(1, -1) == 0); // and begins anew
    CHECK(check(1, -1) == first.view().params->group_count);
    CHECK(check(2, -1) == 0);
    CHECK(check(1, -1) == first.view().params->group_count);
    CHECK(check(2, -1) == 2 * first.view().params->group_count);
    for (Backend* backend : {plain.get(), cached.get()})
        backend->load(second.view());
    CHECK(check(2, -1) == 0);
    CHECK(check(2, -1) == 2 * second.view().params->group_count);

    MemoryBudget budget;
    budget.limit = 1000;
    CudaCut none(budget);
    CHECK_THROWS_AS(none.prepare(1000, 2), Error);
    CHECK(none.needsMemory(1));
    CHECK(budget.used == 0);
}
