// SPDX-License-Identifier: Apache-2.0
// Fast decode against the scalar reference and that against double, over shapes, inputs and block edges.
#include "kernels/threads/parallel.h"
#include "kernels/decode/decode.h"
#include "tests/kernels/simd_targets.h"
#include "tests/kernels/synthetic_model.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

using namespace gsc;
using namespace gsc::test;

namespace {

using Decoded = std::map<uint64_t, GaussianOf<float>>; // by emission order

std::vector<VisibleAnchor> everyAnchor(const ModelView& model, uint32_t limit, uint32_t eye_count)
{
    std::vector<VisibleAnchor> visible;
    for (uint32_t c = 0; c < model.params->chunk_count; ++c)
        for (uint32_t i = 0; i < model.chunks[c].anchor_count && visible.size() < limit; ++i) {
            // with two eyes some anchors are seen by one of them only
            const uint32_t eyes = eye_count == 1 ? 1u : 1 + uint32_t(visible.size() % 3);
            visible.push_back({c, i, eyes, {1, 1}});
        }
    return visible;
}

Decoded decodeFast(const ModelView& model, const std::vector<EyeParams>& eyes,
                   const std::vector<VisibleAnchor>& visible, int32_t appearance, uint32_t eye, bool& any_positive)
{
    Buffer<float> bias;
    DecodeScratch scratch;
    reserveDecode(model, scratch);
    const DecodeArgs args =
        prepareDecode(model, eyes.data(), uint32_t(eyes.size()), visible.data(), visible.size(), appearance, bias);
    Decoded decoded;
    any_positive = false;
    const uint32_t K = model.params->n_offsets;
    for (size_t first = 0; first < visible.size(); first += kDecodeBlock) {
        const uint32_t count = uint32_t(std::min<size_t>(kDecodeBlock, visible.size() - first));
        decodeBlockCpu(args, first, count, scratch);
        const GaussianBlock& block = scratch.blocks[eye];
        any_positive |= block.any_positive;
        for (uint32_t i = 0; i < block.count; ++i) {
            const VisibleAnchor& anchor = visible[first + block.origin[i] / K];
            GaussianOf<float> g{};
            for (int c = 0; c < 3; ++c) {
                g.position[c] = block.position[c][i];
                g.scale[c] = block.scale[c][i];
                g.color[c] = block.color[c][i];
            }
            for (int c = 0; c < 4; ++c)
                g.rotation[c] = block.rotation[c][i];
            g.opacity = block.opacity[i];
            g.order = emissionOrder(model, anchor.chunk, anchor.local, block.origin[i] % K);
            CHECK(decoded.emplace(g.order, g).second);
        }
    }
    return decoded;
}

template <typename Real>
std::map<uint64_t, GaussianOf<Real>> decodeScalar(const ModelView& model, const Real* center,
                                                  const std::vector<VisibleAnchor>& visible, int32_t appearance,
                                                  uint32_t eye, bool& any_positive)
{
    std::vector<SelectedAnchor<Real>> selected;
    for (const VisibleAnchor& anchor : visible)
        if (anchor.eyes >> eye & 1)
            selected.push_back({anchor.chunk, anchor.local, Real(anchor.fraction[eye])});
    std::map<uint64_t, GaussianOf<Real>> decoded;
    for (const auto& g : decodeReference<Real>(model, center, selected, appearance, any_positive))
        decoded.emplace(g.order, g);
    return decoded;
}

struct Errors {
    double position = 0, scale = 0, rotation = 0, opacity = 0, color = 0;
    size_t common = 0, unmatched = 0;
};

// Largest differences; scale relative. A Gaussian in one set only must sit at the opacity floor.
template <typename A, typename B>
Errors difference(const std::map<uint64_t, A>& a, const std::map<uint64_t, B>& b)
{
    Errors errors;
    for (const auto& [order, g] : a) {
        const auto found = b.find(order);
        if (found == b.end()) {
            ++errors.unmatched;
            CHECK(std::abs(double(g.opacity) - double(kOpacityFloor)) < 1e-5);
            continue;
        }
        ++errors.common;
        const B& h = found->second;
        const auto worst = [](double& to, double value) { to = std::max(to, std::abs(value)); };
        for (int c = 0; c < 3; ++c) {
            worst(errors.position, double(g.position[c]) - double(h.position[c]));
            worst(errors.scale, (double(g.scale[c]) - double(h.scale[c])) / (double(h.scale[c]) + 1e-30));
            worst(errors.color, double(g.color[c]) - double(h.color[c]));
        }
        for (int c = 0; c < 4; ++c)
            worst(errors.rotation, double(g.rotation[c]) - double(h.rotation[c]));
        worst(errors.opacity, double(g.opacity) - double(h.opacity));
    }
    for (const auto& [order, h] : b)
        if (a.find(order) == a.end()) {
            ++errors.unmatched;
            CHECK(std::abs(double(h.opacity) - double(kOpacityFloor)) < 1e-5);
        }
    return errors;
}

void checkClose(const Errors& errors)
{
    CHECK(errors.common > 0);
    CHECK(errors.unmatched <= 1 + errors.common / 1000);
    CHECK(errors.position < 1e-5);
    CHECK(errors.scale < 2e-5);
    CHECK(errors.rotation < 2e-5);
    CHECK(errors.opacity < 5e-6);
    CHECK(errors.color < 5e-6);
}

EyeParams someEye(float x)
{
    const float position[3] = {x, 0.4f, -7}, target[3] = {0.2f, 0, 0};
    return lookAt(position, target, 1, 160, 120);
}

void checkModel(const SyntheticOptions& options, uint32_t limit, uint32_t eye_count)
{
    CAPTURE(options.feat_dim);
    CAPTURE(options.n_offsets);
    CAPTURE(limit);
    const SyntheticModel model(options);
    const int32_t appearance = options.appearance_dim > 0 ? int32_t(options.appearance_rows) - 1 : -1;
    std::vector<EyeParams> eyes = {someEye(-0.5f)};
    if (eye_count == 2)
        eyes.push_back(someEye(0.7f));
    const std::vector<VisibleAnchor> visible = everyAnchor(model.view(), limit, eye_count);
    for (uint32_t e = 0; e < eye_count; ++e) {
        bool fast_positive = false, scalar_positive = false, wide_positive = false;
        const auto scalar = decodeScalar<float>(model.view(), eyes[e].center, visible, appearance, e, scalar_positive);
        const EyeParams64 wide_eye = widen(eyes[e]);
        const auto wide = decodeScalar<double>(model.view(), wide_eye.center, visible, appearance, e, wide_positive);
        if (scalar.empty())
            continue;
        checkClose(difference(scalar, wide));
        forEachTarget([&](const char* target) {
            CAPTURE(target);
            checkClose(difference(decodeFast(model.view(), eyes, visible, appearance, e, fast_positive), wide));
            CHECK(fast_positive == scalar_positive);
        });
    }
}

} // namespace

TEST_CASE("counts round the edges of vectors and blocks")
{
    SyntheticOptions options{.anchors = 300};
    for (const uint32_t limit : {1u, 3u, 7u, 8u, 15u, 16u, 17u, 127u, 128u, 129u, 300u})
        checkModel(options, limit, 1);
}

TEST_CASE("feature and offset counts other than 32 and 10")
{
    for (const auto& [F, K] : {std::pair<uint32_t, uint32_t>{4, 1}, {50, 3}, {33, 17}, {16, 25}, {64, 5}, {7, 12}}) {
        SyntheticOptions options{.anchors = 70, .feat_dim = F, .n_offsets = K};
        checkModel(options, 70, 1);
        checkModel(options, 70, 2);
    }
}

TEST_CASE("distance, level and appearance inputs, and the feature bank of both trainers")
{
    for (const uint32_t inputs :
         {uint32_t(kMlpTakesDistance), uint32_t(kMlpTakesLevel), uint32_t(kMlpTakesDistance | kMlpTakesLevel),
          uint32_t(kMlpTakesAppearance), uint32_t(kMlpTakesDistance | kMlpTakesLevel | kMlpTakesAppearance)})
        for (const uint32_t bank : {0u, kModelFeatureBank | kModelBankDistance, kModelFeatureBank | kModelBankLevel,
                                    uint32_t(kModelFeatureBank)})
            for (const uint32_t eyes : {1u, 2u}) {
                SyntheticOptions options{.anchors = 90,
                                         .appearance_dim = inputs & kMlpTakesAppearance ? 32u : 0u,
                                         .appearance_rows = inputs & kMlpTakesAppearance ? 3u : 0u,
                                         .levels = 3,
                                         .flags = kModelHasLevels | bank,
                                         .inputs = inputs,
                                         .level_rule = LevelRule::Floor};
                checkModel(options, 90, eyes);
            }
}

TEST_CASE("progressive fractions scale the opacity before the test")
{
    const SyntheticModel model({.anchors = 100});
    std::vector<VisibleAnchor> visible = everyAnchor(model.view(), 100, 1);
    for (size_t i = 0; i < visible.size(); ++i)
        visible[i].fraction[0] = float(i % 10) / 9;
    const std::vector<EyeParams> eyes = {someEye(0)};
    bool fast_positive, scalar_positive;
    const auto scalar = decodeScalar<float>(model.view(), eyes[0].center, visible, -1, 0, scalar_positive);
    checkClose(difference(decodeFast(model.view(), eyes, visible, -1, 0, fast_positive), scalar));
}

TEST_CASE("trap 17: a camera exactly on an anchor drops that anchor's Gaussians and no other")
{
    SyntheticOptions options{.anchors = 40};
    const SyntheticModel model(options);
    const std::vector<VisibleAnchor> visible = everyAnchor(model.view(), 40, 1);
    std::vector<EyeParams> eyes = {someEye(0)};
    const Vec3<float> p = anchorPosition(model.view(), visible[5].chunk, visible[5].local);
    eyes[0].center[0] = p.x;
    eyes[0].center[1] = p.y;
    eyes[0].center[2] = p.z;
    const uint64_t dropped = model.view().arrays[visible[5].chunk].source_index[visible[5].local];
    forEachTarget([&](const char* target) {
        CAPTURE(target);
        bool fast_positive, scalar_positive;
        const auto scalar = decodeScalar<float>(model.view(), eyes[0].center, visible, -1, 0, scalar_positive);
        const auto fast = decodeFast(model.view(), eyes, visible, -1, 0, fast_positive);
        checkClose(difference(fast, scalar));
        for (const auto& [order, g] : fast)
            CHECK(order / options.n_offsets != dropped);
    });
}

TEST_CASE("masked slots draw nothing, and the others what they drew")
{
    SyntheticOptions options{.anchors = 200};
    SyntheticAnchors anchors = randomAnchors(options);
    const SyntheticModel whole(syntheticParams(options), anchors, randomMlps(options), {}, 0);
    options.flags |= kModelMaskedSlots;
    maskSlots(anchors, options.n_offsets);
    const SyntheticModel masked(syntheticParams(options), anchors, randomMlps(options), {}, 0);
    const std::vector<VisibleAnchor> visible = everyAnchor(masked.view(), 200, 1);
    const std::vector<EyeParams> eyes = {someEye(0)};
    forEachTarget([&](const char* target) {
        CAPTURE(target);
        bool fast_positive, scalar_positive;
        const auto all = decodeFast(whole.view(), eyes, visible, -1, 0, fast_positive);
        const auto fast = decodeFast(masked.view(), eyes, visible, -1, 0, fast_positive);
        const auto scalar = decodeScalar<float>(masked.view(), eyes[0].center, visible, -1, 0, scalar_positive);
        checkClose(difference(fast, scalar));
        CHECK(fast_positive == scalar_positive);
        size_t kept = 0;
        for (const auto& [order, g] : all) {
            const bool gone = isSlotMasked(uint32_t(order / options.n_offsets), uint32_t(order % options.n_offsets));
            kept += gone ? 0 : 1;
            CHECK(fast.contains(order) == !gone);
        }
        CHECK(fast.size() == kept);
        CHECK(kept * 3 > all.size());
    });
}

TEST_CASE("trap 18: NaN features drop the anchor's Gaussians and no other")
{
    SyntheticOptions options{.anchors = 40};
    SyntheticAnchors anchors = randomAnchors(options);
    anchors.feature[32 * 7 + 3] = std::numeric_limits<float>::quiet_NaN();
    const SyntheticModel model(syntheticParams(options), anchors, randomMlps(options), {}, 0);
    const std::vector<VisibleAnchor> visible = everyAnchor(model.view(), 40, 1);
    const std::vector<EyeParams> eyes = {someEye(0)};
    forEachTarget([&](const char* target) {
        CAPTURE(target);
        bool fast_positive, scalar_positive;
        const auto fast = decodeFast(model.view(), eyes, visible, -1, 0, fast_positive);
        const auto scalar = decodeScalar<float>(model.view(), eyes[0].center, visible, -1, 0, scalar_positive);
        checkClose(difference(fast, scalar));
        for (const auto& [order, g] : fast)
            CHECK(order / options.n_offsets != 7);
    });
}

TEST_CASE("blocks do not write past the room they ask for")
{
    SyntheticOptions options{.anchors = 200};
    SyntheticModel model(options);
    std::vector<Mlp> mlps = randomMlps(options);
    for (float& b : mlps[0].layers[1].bias)
        b = 5; // every offset alive: the fullest block there can be
    const SyntheticModel full(syntheticParams(options), randomAnchors(options), mlps, {}, 0);
    const std::vector<VisibleAnchor> visible = everyAnchor(full.view(), 200, 1);
    const std::vector<EyeParams> eyes = {someEye(0)};
    Buffer<float> bias;
    DecodeScratch scratch;
    reserveDecode(full.view(), scratch);
    const GaussianBlock& second_eye = scratch.blocks[1]; // lies behind the first eye's arrays
    const size_t room = kDecodeBlock * options.n_offsets + kMaxLanes;
    for (size_t i = 0; i < room; ++i) {
        second_eye.position[0][i] = 123;
        second_eye.origin[i] = 321;
    }
    const DecodeArgs args = prepareDecode(full.view(), eyes.data(), 1, visible.data(), visible.size(), -1, bias);
    forEachTarget([&](const char* target) {
        CAPTURE(target);
        decodeBlockCpu(args, 0, kDecodeBlock, scratch);
        CHECK(scratch.blocks[0].count == kDecodeBlock * options.n_offsets);
        bool untouched = true;
        for (size_t i = 0; i < room; ++i)
            untouched &= second_eye.position[0][i] == 123 && second_eye.origin[i] == 321;
        CHECK(untouched);
    });
}

TEST_CASE("trap 7: opacity is tanh above zero, and only what can reach 1/255 is kept")
{
    SyntheticOptions options{.anchors = 60};
    std::vector<Mlp> mlps = randomMlps(options);
    for (float& w : mlps[0].layers[1].weight)
        w = 0;
    for (size_t k = 0; k < mlps[0].layers[1].bias.size(); ++k)
        mlps[0].layers[1].bias[k] = k == 3 ? 0.001f : -1.0f; // positive, yet below 1/255
    const SyntheticModel model(syntheticParams(options), randomAnchors(options), mlps, {}, 0);
    const std::vector<VisibleAnchor> visible = everyAnchor(model.view(), 60, 1);
    bool positive = false;
    CHECK(decodeFast(model.view(), {someEye(0)}, visible, -1, 0, positive).empty());
    CHECK(positive);
    for (float& b : mlps[0].layers[1].bias)
        b = -1;
    const SyntheticModel empty(syntheticParams(options), randomAnchors(options), mlps, {}, 0);
    CHECK(decodeFast(empty.view(), {someEye(0)}, visible, -1, 0, positive).empty());
    CHECK_FALSE(positive);
}
