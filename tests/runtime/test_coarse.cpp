// SPDX-License-Identifier: Apache-2.0
// Far groups drawn from coarse copies, on a CPU.
#include "runtime/reuse/coarse/coarse_cpu.h"
#include "tests/backends/coarse_scene.h"
#include "tests/backends/false_colour_tools.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>

using namespace gsc;
using namespace gsc::test;

namespace {

FrameOptions withDetail(float detail)
{
    FrameOptions options;
    options.tier = Tier::Exact;
    options.detail = detail;
    options.background[1] = 0.2f;
    return options;
}

// Sixteen wires and a faint shell behind them on a black ground: the first offset of an anchor is a piece of a wire, the
// second a faint disc. No network sees anything: their last biases are the Gaussians.
std::unique_ptr<SyntheticModel> wiresAndShell(float wire_opacity)
{
    SyntheticOptions options{.anchors = 3200, .n_offsets = 2};
    SyntheticAnchors anchors = randomAnchors(options);
    Random random(5);
    for (uint32_t a = 0; a < options.anchors; ++a) {
        const float position[3] = {0.04f * float(a % 200) - 4, 0.5f * float(a / 200) - 3.75f, 0};
        std::copy_n(position, 3, anchors.position.data() + size_t(3) * a);
        const float scale[6] = {0, 0, 0, -3, -3, -3};
        std::copy_n(scale, 6, anchors.scale.data() + size_t(6) * a);
        const float offset[6] = {0, 0, 0, 0, random.uniform(-0.25f, 0.25f), 3};
        std::copy_n(offset, 6, anchors.offset.data() + size_t(6) * a);
    }
    std::vector<Mlp> mlps = randomMlps(options);
    for (Mlp& mlp : mlps) {
        std::fill(mlp.layers[1].weight.begin(), mlp.layers[1].weight.end(), 0.0f);
        std::vector<float>& bias = mlp.layers[1].bias;
        if (mlp.kind == MlpKind::Opacity)
            bias = {std::atanh(wire_opacity), std::atanh(0.02f)};
        else if (mlp.kind == MlpKind::Color)
            bias = {3, 3, 3, 1, 2, 3};
        else // scales by the sigmoid, then the quaternion
            bias = {3, -4, -4, 1, 0, 0, 0, 2, 2, -4, 1, 0, 0, 0};
    }
    return std::make_unique<SyntheticModel>(syntheticParams(options), anchors, mlps, std::vector<float>(), 0);
}

double lightOf(const std::vector<float>& pixels)
{
    double light = 0;
    for (const float v : pixels)
        light += double(v);
    return light;
}

// The summed light of wires and a faint shell stays within `part`, from near and from far.
void checkCoarseLight(FrameOptions options, float wire_opacity, double part)
{
    const auto model = wiresAndShell(wire_opacity);
    std::fill_n(options.background, 3, 0.0f);
    for (const float distance : {12.0f, 20.0f, 40.0f, 80.0f}) {
        CAPTURE(distance);
        const auto coarse = open(model->view()), plain = open(model->view());
        FrameOptions whole = options;
        whole.detail = 0;
        for (int i = 0; i < 40; ++i)
            (void)render(*coarse, farWalk(0, 1, distance), options);
        const auto a = render(*coarse, farWalk(0, 1, distance), options);
        const auto b = render(*plain, farWalk(0, 1, distance), whole);
        CHECK(a[0].result.eyes[0].gaussians_visible < b[0].result.eyes[0].gaussians_visible);
        CHECK(lightOf(a[0].pixels) == doctest::Approx(lightOf(b[0].pixels)).epsilon(part));
    }
}

} // namespace

TEST_CASE("detail: the light of wires and of a faint shell stays")
{
    for (const float detail : {1.0f, 2.0f, 4.0f}) {
        CAPTURE(detail);
        checkCoarseLight(withDetail(detail), 0.02f, 0.01 * double(detail));
        // pieces that cover each other: what is joined has a profile of its own, not that of all behind each other
        checkCoarseLight(withDetail(detail), 0.4f, detail > 2 ? 0.35 : 0.25);
    }
}

TEST_CASE("detail: same poses, same bytes, on any number of threads")
{
    const auto model = coarseModel(LevelRule::Round);
    FrameOptions options = withDetail(2);
    for (const uint64_t room : {uint64_t(0), uint64_t(1) << 20}) {
        options.reuse.cache_bytes = room;
        const auto one = open(model->view(), 1), many = open(model->view(), 3);
        for (int i = 0; i < 12; ++i) {
            CAPTURE(i);
            CHECK(sameBytes(render(*one, farWalk(60 * i), options), render(*many, farWalk(60 * i), options)));
        }
    }
}

TEST_CASE("detail: frames without it, between those with it, keep their bytes; and the others go on")
{
    const auto model = coarseModel();
    const auto mixed = open(model->view()), plain = open(model->view()), coarse = open(model->view());
    const FrameOptions options = withDetail(2);
    FrameOptions whole = options;
    whole.detail = 0;
    for (int i = 0; i < 6; ++i) {
        CAPTURE(i);
        CHECK(sameBytes(render(*mixed, farWalk(i), whole), render(*plain, farWalk(i), whole)));
        CHECK(sameBytes(render(*mixed, farWalk(i), options), render(*coarse, farWalk(i), options)));
    }
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
        CHECK(counts.stale == 0); // copies that are due are made
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

TEST_CASE("detail: the reference keeps nothing and refuses it")
{
    const auto model = coarseModel();
    const auto reference = open(model->view(), "cpu-reference");
    CHECK_THROWS_AS(render(*reference, farWalk(0, 1), withDetail(2)), Error);
    FrameOptions both = withDetail(2);
    both.reuse.policy = ReusePolicy::Error;
    CHECK_THROWS_AS(render(*open(model->view()), farWalk(0, 1), both), Error);
}
