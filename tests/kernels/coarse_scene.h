// SPDX-License-Identifier: Apache-2.0
// Checks of frames with FrameOptions::detail, for every backend.
#pragma once

#include "tests/backends/false_colour_tools.h"
#include "tests/kernels/render_tools.h"
#include "tests/kernels/synthetic_model.h"

#include <doctest/doctest.h>

#include <cmath>
#include <cstring>
#include <functional>
#include <memory>
#include <vector>

namespace gsc::test {

// A renderer that has the model and has drawn nothing.
using CoarseMaker = std::function<std::unique_ptr<Renderer>(const ModelView&)>;

// Some dozen groups of fine Gaussians, 8 units wide, those of an anchor apart from each other.
inline std::unique_ptr<SyntheticModel> coarseModel(SyntheticOptions options)
{
    options.anchors = 6000;
    options.log_scale = -4;
    options.seed = 11;
    SyntheticAnchors anchors = randomAnchors(options);
    for (size_t a = 0; a < anchors.count(); ++a)
        std::fill_n(anchors.scale.data() + 6 * a, 3, -1.0f);
    if ((options.flags & kModelMaskedSlots) != 0)
        maskSlots(anchors, options.n_offsets);
    Random random(3);
    std::vector<float> rows(size_t(options.appearance_dim) * options.appearance_rows);
    for (float& value : rows)
        value = random.normal();
    return std::make_unique<SyntheticModel>(syntheticParams(options), anchors, randomMlps(options), rows,
                                            options.cell_log2);
}

inline std::unique_ptr<SyntheticModel> coarseModel(LevelRule rule = LevelRule::None)
{
    return coarseModel(octree(rule));
}

// Every input of the networks, other positions and rules, and slots that are masked.
inline std::unique_ptr<SyntheticModel> coarseModelOfAll()
{
    SyntheticOptions options;
    options.raster_rules = RasterRules::Gsplat;
    options.encoding = PositionEncoding::Float;
    options.appearance_dim = 8;
    options.appearance_rows = 3;
    options.flags |= kModelFeatureBank | kModelBankDistance | kModelMaskedSlots;
    options.inputs = kMlpTakesDistance | kMlpTakesAppearance;
    options.n_offsets = 5;
    return coarseModel(options);
}

// Frame `i` of a walk that the model is far from for the most part: a step is a forty thousandth of the distance.
inline std::vector<EyeParams> farWalk(int i, size_t eye_count = 2, float distance = 40, float turned = 0)
{
    std::vector<EyeParams> eyes;
    for (size_t e = 0; e < eye_count; ++e) {
        const float position[3] = {0.001f * float(i) + 0.06f * float(e), 0.3f, -distance};
        const float target[3] = {0.1f + distance * std::tan(turned), -0.2f, 0.3f};
        eyes.push_back(lookAt(position, target, 0.6f, 160, 120));
    }
    return eyes;
}

inline FrameOptions detailed(float detail, Tier tier)
{
    FrameOptions options;
    options.tier = tier;
    options.detail = detail;
    options.background[1] = 0.2f;
    return options;
}

inline uint64_t coarseGroups(const CoarseCounts& counts)
{
    return counts.kept + counts.stale + counts.made;
}

// PSNR of a frame of `coarse` against one of `plain` without detail, the worse of the eyes.
inline double detailLoss(Renderer& coarse, Renderer& plain, const std::vector<EyeParams>& eyes, FrameOptions options,
                         CoarseCounts* counts = nullptr)
{
    const auto actual = render(coarse, eyes, options);
    options.detail = 0;
    const auto expected = render(plain, eyes, options);
    double worst = 200;
    for (size_t e = 0; e < eyes.size(); ++e)
        worst = std::min(worst, compare(actual[e].pixels, expected[e].pixels).psnr);
    if (counts != nullptr)
        *counts = actual[0].result.coarse;
    return worst;
}

// Far groups are drawn coarse, with fewer Gaussians, near what is drawn without; all is counted.
inline void checkCoarse(const CoarseMaker& open, const ModelView& model, const FrameOptions& options, double least_db,
                        size_t eye_count)
{
    const auto coarse = open(model), plain = open(model);
    CoarseCounts counts;
    for (int i = 0; i < 40; ++i)
        (void)render(*coarse, farWalk(i, eye_count), options);
    CHECK(detailLoss(*coarse, *plain, farWalk(40, eye_count), options, &counts) > least_db);
    CHECK(coarseGroups(counts) > 3 * counts.near);
    FrameOptions whole = options;
    whole.detail = 0;
    const FrameResult a = render(*coarse, farWalk(41, eye_count), options)[0].result;
    const FrameResult b = render(*plain, farWalk(41, eye_count), whole)[0].result;
    CHECK(coarseGroups(b.coarse) + b.coarse.near == 0);
    for (size_t e = 0; e < eye_count; ++e) {
        CHECK(a.eyes[e].gaussians_visible < 0.85 * double(b.eyes[e].gaussians_visible));
        CHECK(a.eyes[e].anchors_reused > 0.5 * double(b.eyes[e].anchors_visible));
        CHECK(a.eyes[e].anchors_overdue <= a.eyes[e].anchors_reused);
        CHECK(a.eyes[e].anchors_reused <= a.eyes[e].anchors_visible);
    }
}

// Same poses, same bytes, from a cold start each time.
inline void checkCoarseBytes(Renderer& a, Renderer& b, const FrameOptions& options)
{
    for (int i = 0; i < 12; ++i) {
        CAPTURE(i);
        const auto one = render(a, farWalk(60 * i), options), two = render(b, farWalk(60 * i), options);
        for (size_t e = 0; e < 2; ++e)
            CHECK(sameBytes(one[e].pixels, two[e].pixels));
    }
}

// FrameView::Age of young copies, over black: least and most green of the pixels by their blue, as ageColour() mixes them.
inline std::pair<float, float> agesShown(const std::vector<Image<float>>& images, float slack)
{
    std::pair<float, float> shown(1.0f, 0.0f);
    size_t others = 0;
    for (const Image<float>& image : images)
        for (size_t p = 0; p < image.pixels.size(); p += 3)
            if (const float blue = image.pixels[p + 2]; blue > 0.5f) {
                others += image.pixels[p] > slack;
                shown.first = std::min(shown.first, image.pixels[p + 1] / blue);
                shown.second = std::max(shown.second, image.pixels[p + 1] / blue);
            }
    CHECK(others == 0);
    return shown;
}

// Copies grow old by a frame each, whatever the frame shows, and are new where they are made anew. `frames`: by when all
// are made, 3 at most.
inline void checkCoarseAges(Renderer& renderer, FrameOptions options, uint32_t frames, float slack)
{
    std::fill_n(options.background, 3, 0.0f);
    options.detail = kMostDetail;
    for (uint32_t i = 0; i < 4; ++i) {
        CAPTURE(i);
        options.view = i == 2 ? FrameView::Picture : FrameView::Age;
        const auto images = render(renderer, farWalk(0), options);
        CHECK((images[0].result.coarse.made > 0) == (i < frames));
        if (options.view == FrameView::Picture)
            continue;
        const auto [least, most] = agesShown(images, slack);
        CHECK(least == doctest::Approx(ageColour(i < frames ? 0 : i - frames + 1).g).epsilon(slack));
        CHECK(most == doctest::Approx(ageColour(i).g).epsilon(slack));
    }
    CHECK(agesShown(render(renderer, farWalk(0, 2, 30), options), slack).first < slack);
}

// A camera at rest: once the copies are made nothing changes. `frames`: by when they are.
inline void checkCoarseRest(Renderer& renderer, const FrameOptions& options, int frames)
{
    for (int i = 0; i < frames; ++i)
        (void)render(renderer, farWalk(0), options);
    const auto first = render(renderer, farWalk(0), options);
    CHECK(first[0].result.coarse.made == 0);
    CHECK(first[0].result.coarse.stale == 0);
    for (int i = 0; i < 3; ++i) {
        const auto again = render(renderer, farWalk(0), options);
        for (size_t e = 0; e < 2; ++e)
            CHECK(sameBytes(again[e].pixels, first[e].pixels));
    }
}

// A head that turns fast sees what it never saw, without a hole.
inline void checkCoarseTurn(const CoarseMaker& open, const ModelView& model, const FrameOptions& options,
                            double least_db)
{
    const auto coarse = open(model), plain = open(model);
    for (int i = 0; i < 12; ++i) {
        CAPTURE(i);
        const float turned = 0.25f - 0.05f * float(i % 10);
        CHECK(detailLoss(*coarse, *plain, farWalk(0, 2, 25, turned), options) > least_db);
    }
}

// Frames without detail, between those with it, are what they always were; and the others go on.
inline void checkCoarsePlain(Renderer& mixed, Renderer& plain, Renderer& coarse, const FrameOptions& options)
{
    FrameOptions whole = options;
    whole.detail = 0;
    for (int i = 0; i < 6; ++i) {
        CAPTURE(i);
        const auto a = render(mixed, farWalk(i), whole), b = render(plain, farWalk(i), whole);
        const auto c = render(mixed, farWalk(i), options), d = render(coarse, farWalk(i), options);
        for (size_t e = 0; e < 2; ++e) {
            CHECK(sameBytes(a[e].pixels, b[e].pixels));
            CHECK(sameBytes(c[e].pixels, d[e].pixels));
        }
    }
}

// Another appearance, and dropCaches(), forget everything: what follows is what a cold renderer draws.
inline void checkCoarseForgets(Renderer& used, Renderer& cold, FrameOptions options)
{
    options.appearance = 1;
    for (int i = 0; i < 30; ++i)
        (void)render(used, farWalk(i), options);
    options.appearance = 2;
    const auto a = render(used, farWalk(30), options), b = render(cold, farWalk(30), options);
    CHECK(a[0].result.coarse.kept == 0);
    CHECK(coarseGroups(a[0].result.coarse) == coarseGroups(b[0].result.coarse));
    for (size_t e = 0; e < 2; ++e)
        CHECK(sameBytes(a[e].pixels, b[e].pixels));
    used.dropCaches();
    cold.dropCaches();
    const auto c = render(used, farWalk(31), options), d = render(cold, farWalk(31), options);
    CHECK(c[0].result.coarse.kept == 0);
    CHECK(sameBytes(c[0].pixels, d[0].pixels));
}

// Sixteen wires and a faint shell behind them on a black ground: the first offset of an anchor is a piece of a wire, the
// second a faint disc. No network sees anything: their last biases are the Gaussians.
inline std::unique_ptr<SyntheticModel> wiresAndShell(float wire_opacity)
{
    SyntheticOptions options;
    options.anchors = 3200;
    options.n_offsets = 2;
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

inline double lightOf(const std::vector<float>& pixels)
{
    double light = 0;
    for (const float v : pixels)
        light += double(v);
    return light;
}

// The summed light of wires and a faint shell stays within `part`, from near and from far.
inline void checkCoarseLight(const CoarseMaker& open, FrameOptions options, float wire_opacity, double part)
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

} // namespace gsc::test
