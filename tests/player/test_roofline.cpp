// SPDX-License-Identifier: Apache-2.0
#include "player/measure/roofline.h"

#include <doctest/doctest.h>

#include <vector>

using namespace gsc;

namespace {

// F = 32, K = 10, three heads of 32 hidden units, as the trainers make them.
struct Model {
    ModelParams params{};
    std::vector<MlpRecord> mlps;

    Model()
    {
        params.feat_dim = 32;
        params.n_offsets = 10;
        add(MlpKind::Opacity, kMlpTakesFeature, 35, 10);
        add(MlpKind::Covariance, kMlpTakesFeature, 35, 70);
        add(MlpKind::Color, kMlpTakesFeature, 35, 30);
    }

    void add(MlpKind kind, uint32_t inputs, uint32_t in, uint32_t out)
    {
        MlpRecord mlp{};
        mlp.kind = uint32_t(kind);
        mlp.inputs = inputs;
        mlp.in = in;
        mlp.hidden = 32;
        mlp.out = out;
        mlps.push_back(mlp);
        params.mlp_count = uint32_t(mlps.size());
    }

    [[nodiscard]] AnchorCost cost(Tier tier) const
    {
        ModelView view{};
        view.params = &params;
        view.weights = reinterpret_cast<const std::byte*>(mlps.data());
        return anchorCost(view, tier);
    }
};

// Round numbers: 4 TB/s read, 3 TB/s copy (so a written byte takes 2 / 3 - 1 / 4 = 5 / 12 ps), 30 T lanes.
constexpr DeviceCeilings kCeilings{3e12, 4e12, 30e12, 500e12, 4e12};

EyeCounts eye(uint64_t groups, uint64_t tested, uint64_t visible, uint64_t splats, uint64_t pairs, uint64_t evaluations)
{
    EyeCounts counts;
    counts.groups_tested = groups;
    counts.anchors_tested = tested;
    counts.anchors_visible = visible;
    counts.gaussians_visible = splats;
    counts.pairs = pairs;
    counts.blend_evaluations = evaluations;
    return counts;
}

void checkWork(const StageWork& work, const StageWork& expected)
{
    CHECK(work.bytes_read == doctest::Approx(expected.bytes_read));
    CHECK(work.bytes_written == doctest::Approx(expected.bytes_written));
    CHECK(work.lane_operations == doctest::Approx(expected.lane_operations));
    CHECK(work.exponentials == doctest::Approx(expected.exponentials));
    CHECK(work.matrix_flop == doctest::Approx(expected.matrix_flop));
}

} // namespace

TEST_CASE("an anchor of the trainers' shape")
{
    const AnchorCost fast = Model().cost(Tier::Fast);
    CHECK(fast.bytes == 188);        // 4 + 16 + 24 + 2 x 32 + 8 x 10
    CHECK(fast.shared_macs == 3072); // 32 x 96
    CHECK(fast.eye_macs == 3808);    // 3 x 96 + 32 x 110
    CHECK(fast.splat_bytes == 32);
    CHECK_FALSE(fast.exact);

    const AnchorCost exact = Model().cost(Tier::Exact);
    CHECK(exact.bytes == 292); // 4 + 4 x 62 + 16 + 24
    CHECK(exact.shared_macs == 3072);
    CHECK(exact.splat_bytes == 48);
    CHECK(exact.exact);
}

TEST_CASE("distance and level are the eye's, an appearance is nobody's")
{
    Model model;
    model.params.appearance_dim = 16;
    model.mlps[0].inputs |= kMlpTakesDistance | kMlpTakesLevel;
    model.mlps[0].in += 2;
    model.mlps[2].inputs |= kMlpTakesAppearance;
    model.mlps[2].in += 16;
    const AnchorCost cost = model.cost(Tier::Fast);
    CHECK(cost.shared_macs == 3072);
    CHECK(cost.eye_macs == 3808 + 2 * 32);
}

TEST_CASE("a feature bank makes the features' part the eye's")
{
    Model model;
    model.add(MlpKind::FeatureBank, kMlpTakesDistance, 4, 3);
    const AnchorCost cost = model.cost(Tier::Exact);
    CHECK(cost.shared_macs == 0);
    CHECK(cost.eye_macs == 3808 + 3072 + 4 * 32 + 32 * 3);
}

TEST_CASE("two eyes by hand")
{
    const EyeCounts eyes[2] = {eye(1000, 20000, 10000, 30000, 50000, 4000000),
                               eye(1000, 18000, 9000, 26000, 40000, 3000000)};
    const FrameWork work = leastWork(Model().cost(Tier::Fast), eyes, 2, 1e6, true);
    checkWork(work.select, {80.0 * 1000 + 28.0 * 20000, 4.0 * 10000, 0, 0, 0});
    checkWork(work.decode, {188.0 * 10000, 40.0 * 56000, 0, 0, 2 * (3072.0 * 10000 + 3808.0 * 19000)});
    checkWork(work.bin, {8.0 * 56000, 8.0 * 90000, 0, 0, 0});
    checkWork(work.sort, {8.0 * 90000, 8.0 * 90000, 0, 0, 0});
    checkWork(work.blend, {36.0 * 90000, 24e6, 14 * 7e6, 7e6, 0});
}

TEST_CASE("two eyes that share their tiles list a splat once, and each reads the list")
{
    const EyeCounts eyes[2] = {eye(1000, 20000, 10000, 30000, 52000, 4000000),
                               eye(1000, 18000, 9000, 26000, 0, 3000000)};
    const FrameWork work = leastWork(Model().cost(Tier::Fast), eyes, 2, 1e6, true);
    CHECK(work.decode.bytes_written == doctest::Approx(32.0 * 56000 + 8.0 * 30000));
    checkWork(work.bin, {8.0 * 30000, 8.0 * 52000, 0, 0, 0});
    checkWork(work.sort, {8.0 * 52000, 8.0 * 52000, 0, 0, 0});
    checkWork(work.blend, {36.0 * 104000, 24e6, 14 * 7e6, 7e6, 0});

    const EyeCounts looks_away[2] = {eyes[0], eye(1000, 0, 0, 0, 0, 0)};
    const FrameWork alone = leastWork(Model().cost(Tier::Fast), looks_away, 2, 1e6, true);
    CHECK(alone.blend.bytes_read == doctest::Approx(36.0 * 52000));
    CHECK(alone.bin.bytes_read == doctest::Approx(8.0 * 30000));
}

TEST_CASE("blending that sorts reads whole pairs; exact decodes on lanes")
{
    const EyeCounts one = eye(10, 1000, 1000, 2000, 3000, 0);
    const FrameWork work = leastWork(Model().cost(Tier::Exact), &one, 1, 100, false);
    checkWork(work.sort, {});
    checkWork(work.blend, {56.0 * 3000, 1200, 0, 0, 0});
    checkWork(work.decode, {292.0 * 1000, 56.0 * 2000, 6880.0 * 1000, 0, 0});
}

TEST_CASE("the slowest ceiling makes the floor")
{
    const auto floor = [](const StageWork& work) { return floorOf(work, kCeilings); };
    CHECK(floor({}).ms == 0);
    CHECK(floor({}).bound == Bound::None);
    CHECK(floor({4e9, 0, 0, 0, 0}).ms == doctest::Approx(1));     // read alone
    CHECK(floor({3e9, 3e9, 0, 0, 0}).ms == doctest::Approx(2));   // copy: 6 GB at 3 TB/s
    CHECK(floor({0, 1.2e9, 0, 0, 0}).ms == doctest::Approx(0.5)); // 1.2 GB x 5 / 12 ps
    CHECK(floor({4e9, 0, 29e9, 3.9e9, 499e9}).bound == Bound::Memory);
    CHECK(floor({4e9, 0, 60e9, 4e9, 0}).bound == Bound::Lanes);
    CHECK(floor({4e9, 0, 60e9, 4e9, 0}).ms == doctest::Approx(2));
    CHECK(floor({0, 0, 0, 8e9, 0}).bound == Bound::Exponentials);
    CHECK(floor({0, 0, 0, 8e9, 0}).ms == doctest::Approx(2));
    CHECK(floor({0, 0, 0, 0, 1e12}).bound == Bound::Matrix);
    CHECK(floor({0, 0, 0, 0, 1e12}).ms == doctest::Approx(2));
}
