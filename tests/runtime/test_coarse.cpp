// SPDX-License-Identifier: Apache-2.0
// Far groups drawn from coarse copies, on a CPU.
#include "runtime/reuse/coarse/coarse_cpu.h"
#include "tests/kernels/coarse_scene.h"
#include "tests/backends/reuse_scene.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <set>

using namespace gsc;
using namespace gsc::test;

namespace {

const CoarseMaker kOpen = [](const ModelView& view) { return open(view, 2); };

FrameOptions withDetail(float detail)
{
    return detailed(detail, Tier::Exact);
}

} // namespace

TEST_CASE("detail: far groups are drawn from fewer Gaussians, near what is drawn without")
{
    const auto model = coarseModel();
    for (const size_t eyes : {1, 2}) {
        CAPTURE(eyes);
        checkCoarse(kOpen, model->view(), withDetail(2), 38, eyes);
    }
    const auto loss = [&](float detail) {
        return detailLoss(*open(model->view()), *open(model->view()), farWalk(0), withDetail(detail));
    };
    CHECK(loss(1) > loss(2) + 2);
    CHECK(loss(2) > loss(4) + 2);
}

TEST_CASE("detail: gsplat's rules, masked slots, float positions and every input of the networks")
{
    const auto model = coarseModelOfAll();
    FrameOptions frame = withDetail(2);
    frame.appearance = 1;
    CHECK(detailLoss(*open(model->view()), *open(model->view()), farWalk(0), frame) > 34);
    checkCoarseForgets(*open(model->view()), *open(model->view()), frame);
}

TEST_CASE("detail: the light of wires and of a faint shell stays")
{
    for (const float detail : {1.0f, 2.0f, 4.0f}) {
        CAPTURE(detail);
        checkCoarseLight(kOpen, withDetail(detail), 0.02f, 0.01 * double(detail));
        // pieces that cover each other: what is joined has a profile of its own, not that of all behind each other
        checkCoarseLight(kOpen, withDetail(detail), 0.4f, detail > 2 ? 0.35 : 0.25);
    }
}

TEST_CASE("detail: same poses, same bytes, on any number of threads")
{
    const auto model = coarseModel(LevelRule::Round);
    FrameOptions options = withDetail(2);
    checkCoarseBytes(*open(model->view(), 2), *open(model->view(), 2), options);
    checkCoarseBytes(*open(model->view(), 1), *open(model->view(), 3), options);
    options.reuse.cache_bytes = 1u << 20;
    checkCoarseBytes(*open(model->view(), 1), *open(model->view(), 3), options);
}

TEST_CASE("detail: a camera at rest draws the same bytes, and a head that turns finds no hole")
{
    const auto model = coarseModel();
    checkCoarseRest(*open(model->view()), withDetail(2), 1);
    checkCoarseTurn(kOpen, model->view(), withDetail(2), 36);
}

TEST_CASE("detail: frames without it keep their bytes")
{
    const auto model = coarseModel();
    checkCoarsePlain(*open(model->view()), *open(model->view()), *open(model->view()), withDetail(2));
}

TEST_CASE("detail: levels, their switches and their fades")
{
    for (const LevelRule rule : {LevelRule::Round, LevelRule::Progressive})
        for (const float fade : {0.0f, 0.5f}) {
            CAPTURE(int(rule));
            CAPTURE(fade);
            const auto model = coarseModel(rule);
            const auto coarse = open(model->view()), plain = open(model->view());
            FrameOptions options = withDetail(2);
            options.lod_fade = fade;
            for (int i = 0; i < 8; ++i) {
                CAPTURE(i);
                options.lod_bias = i < 4 ? 0.0f : 1.0f;
                // of what has come nearer by less than kMostCloser, levels that are new may be missing
                CHECK(detailLoss(*coarse, *plain, farWalk(i, 2, 40 - 2 * float(i)), options) > 29);
            }
        }
}

TEST_CASE("detail: copies are made anew as the camera goes on, and none is drawn that is far off")
{
    const auto model = coarseModel();
    const auto coarse = open(model->view()), plain = open(model->view());
    uint64_t made = 0, kept = 0;
    for (int i = 0; i < 30; ++i) {
        CAPTURE(i);
        CoarseCounts counts;
        CHECK(detailLoss(*coarse, *plain, farWalk(200 * i, 2, 40 - 0.6f * float(i)), withDetail(2), &counts) > 35);
        made += i > 0 ? counts.made : 0;
        kept += counts.kept;
        CHECK(counts.stale == 0); // what is due is made
    }
    CHECK(made > 30);
    CHECK(kept > 2 * made);
}

TEST_CASE("detail: a limit of memory is kept, by giving up what was not drawn lately, and shows as nothing else")
{
    const auto model = coarseModel();
    const auto plain = open(model->view()), coarse = open(model->view());
    const uint64_t all = render(*open(model->view()), farWalk(0), withDetail(2))[0].result.cache_bytes;
    FrameOptions options = withDetail(2);
    options.reuse.cache_bytes = all / 2;
    CoarseCounts counts;
    CHECK(detailLoss(*coarse, *plain, farWalk(0), options, &counts) > 38);
    CHECK(counts.near > 0);
    CHECK(coarseGroups(counts) > 0);
    uint64_t evictions = 0;
    options.reuse.cache_bytes = all / 8;
    for (int i = 0; i < 12; ++i) {
        const auto frame = render(*coarse, farWalk(0, 2, 10, i % 4 < 2 ? 0.5f : -0.5f), options);
        CHECK(frame[0].result.cache_bytes <= options.reuse.cache_bytes);
        evictions += frame[0].result.cache_evictions;
    }
    CHECK(evictions > 0);
    options.reuse.cache_bytes = 1; // room for nothing
    CHECK(detailLoss(*open(model->view()), *plain, farWalk(0), options, &counts) == 200);
    CHECK(coarseGroups(counts) == 0);
}

TEST_CASE("detail: a band of columns is what the whole picture shows there")
{
    const auto model = coarseModel();
    const auto whole = open(model->view()), left = open(model->view()), right = open(model->view());
    for (int i = 0; i < 6; ++i) {
        CAPTURE(i);
        FrameOptions options = withDetail(2);
        const auto expected = render(*whole, farWalk(40 * i), options);
        options.columns = {0, 64};
        auto actual = render(*left, farWalk(40 * i), options);
        options.columns = {64, 160};
        const auto other = render(*right, farWalk(40 * i), options);
        for (size_t e = 0; e < 2; ++e) {
            for (size_t p = 0; p < actual[e].pixels.size(); ++p)
                if (p / 3 % 160 >= 64)
                    actual[e].pixels[p] = other[e].pixels[p];
            CHECK(compare(actual[e].pixels, expected[e].pixels).psnr > 50);
        }
    }
}

TEST_CASE("detail: false colours tell how a group is drawn, and change nothing else")
{
    const auto model = coarseModel();
    const auto painted = open(model->view()), plain = open(model->view());
    for (int i = 0; i < 8; ++i) {
        CAPTURE(i);
        FrameOptions options = withDetail(2);
        const auto expected = render(*plain, farWalk(100 * i), options);
        options.view = FrameView(uint32_t(i) % kFrameViews);
        const auto actual = render(*painted, farWalk(100 * i), options);
        CHECK(sameBytes(expected[0].pixels, actual[0].pixels) == (options.view == FrameView::Picture));
        CHECK(expected[0].result.coarse.made == actual[0].result.coarse.made);
        CHECK(expected[0].result.eyes[0].blend_evaluations == actual[0].result.eyes[0].blend_evaluations);
    }
    // of a cold frame that is far all over, one colour shows
    FrameOptions options = withDetail(2);
    options.view = FrameView::Detail;
    std::fill_n(options.background, 3, 0.0f);
    const auto cold = render(*open(model->view()), farWalk(0, 1, 80), options);
    CHECK(cold[0].result.coarse.near == 0);
    const FalseColour made = detailColour(GroupSource::Made);
    size_t lit = 0, others = 0;
    for (size_t p = 0; p < cold[0].pixels.size(); p += 3) {
        const float light = cold[0].pixels[p + 1] / made.g;
        lit += light > 0.05f;
        others += std::abs(cold[0].pixels[p] - light * made.r) > 1e-4f ||
                  std::abs(cold[0].pixels[p + 2] - light * made.b) > 1e-4f;
    }
    CHECK(lit > 20);
    CHECK(others == 0);
}

TEST_CASE("detail: the view of ages shows frames since a copy was made")
{
    const auto model = coarseModel();
    checkCoarseAges(*kOpen(model->view()), withDetail(2), 1, 1e-4f);
}

TEST_CASE("detail: the reference keeps nothing and refuses it")
{
    const auto model = coarseModel();
    const auto reference = makeCpuRenderer(CpuPath::Reference, 1);
    reference->load(model->view());
    CHECK_THROWS_AS(render(*reference, farWalk(0, 1), withDetail(2)), Error);
    FrameOptions both = withDetail(2);
    both.reuse.policy = ReusePolicy::Error;
    CHECK_THROWS_AS(render(*open(model->view()), farWalk(0, 1), both), Error);
}
