// SPDX-License-Identifier: Apache-2.0
// The cut and the order cache in the frame loop: not a bit of any frame changes, whatever else is reused.
#include "tests/kernels/render_tools.h"
#include "tests/kernels/synthetic_model.h"

#include <doctest/doctest.h>

using namespace gsc;
using namespace gsc::test;

namespace {

std::vector<EyeParams> walk(int i, size_t eye_count)
{
    std::vector<EyeParams> eyes;
    for (size_t e = 0; e < eye_count; ++e) {
        const float position[3] = {0.2f + 0.02f * float(i) + 0.1f * float(e), 0.3f, -5 + 0.01f * float(i)};
        const float target[3] = {0.1f, -0.2f, 0.3f};
        eyes.push_back(lookAt(position, target, 0.9f, 120, 90));
    }
    return eyes;
}

std::unique_ptr<Backend> open(const ModelView& model, int threads)
{
    std::unique_ptr<Backend> backend = makeCpuBackend(CpuPath::Fast, threads);
    backend->load(model);
    return backend;
}

SyntheticOptions modelOptions()
{
    SyntheticOptions options;
    options.anchors = 4000;
    options.log_scale = -4.5f;
    options.levels = 4;
    options.level_rule = LevelRule::Floor;
    options.flags = kModelHasLevels | kModelLodHalfCell;
    return options;
}

} // namespace

TEST_CASE("with both caches every frame of a walk is the same picture, for every policy, one eye and two")
{
    const SyntheticModel model(modelOptions());
    for (const ReusePolicy policy : {ReusePolicy::None, ReusePolicy::Depth, ReusePolicy::Error})
        for (const size_t eyes : {1, 2}) {
            CAPTURE(int(policy));
            CAPTURE(eyes);
            const auto plain = open(model.view(), 1), cached = open(model.view(), 2);
            FrameOptions without, with;
            without.reuse.policy = with.reuse.policy = policy;
            with.reuse.cut = with.reuse.order = true;
            uint64_t kept = 0, moves = 0, splats = 0;
            for (int i = 0; i < 12; ++i) {
                const int place = i < 9 ? i : i * 20; // then it jumps
                const auto expected = render(*plain, walk(place, eyes), without);
                const auto actual = render(*cached, walk(place, eyes), with);
                for (size_t e = 0; e < eyes; ++e) {
                    CHECK(actual[e].pixels == expected[e].pixels);
                    const EyeCounts &a = actual[0].result.eyes[e], &b = expected[0].result.eyes[e];
                    CHECK(a.anchors_visible == b.anchors_visible);
                    CHECK(a.gaussians_visible == b.gaussians_visible);
                    CHECK(a.pairs == b.pairs);
                    splats += i > 0 ? a.gaussians_visible : 0;
                }
                CHECK(expected[0].result.groups_kept == 0);
                CHECK(expected[0].result.order_moves == 0);
                kept += actual[0].result.groups_kept;
                moves += i > 0 ? actual[0].result.order_moves : 0;
                CHECK(actual[0].result.bytes_resident > expected[0].result.bytes_resident);
            }
            CHECK(kept > 100);
            CHECK(moves > 0);
            CHECK(moves < splats);
        }
}

TEST_CASE("dropped caches and another model: nothing is kept")
{
    const SyntheticModel model(modelOptions());
    SyntheticOptions other_options = modelOptions();
    other_options.seed = 77;
    const SyntheticModel other(other_options);
    FrameOptions options;
    options.reuse.cut = options.reuse.order = true;
    const auto backend = open(model.view(), 1), fresh = open(other.view(), 1);
    render(*backend, walk(0, 1), options);
    const FrameResult again = render(*backend, walk(0, 1), options)[0].result;
    CHECK(again.groups_kept > 0);
    CHECK(again.eyes[0].groups_tested == 0);
    CHECK(again.order_moves < again.eyes[0].gaussians_visible);
    backend->dropCaches();
    const FrameResult dropped = render(*backend, walk(0, 1), options)[0].result;
    CHECK(dropped.groups_kept == 0);
    CHECK(dropped.eyes[0].groups_tested == again.groups_kept);
    CHECK(dropped.order_moves == dropped.eyes[0].gaussians_visible);
    backend->load(other.view());
    const auto loaded = render(*backend, walk(0, 1), options), expected = render(*fresh, walk(0, 1), FrameOptions{});
    CHECK(loaded[0].result.groups_kept == 0);
    CHECK(loaded[0].pixels == expected[0].pixels);
}
