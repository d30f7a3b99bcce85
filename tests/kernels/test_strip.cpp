// SPDX-License-Identifier: Apache-2.0
// Kept strips against the scalar decode: one key, two keys, lanes, factors, short strips.
#include "kernels/decode/strip.h"
#include "kernels/math/eye.h"
#include "tests/kernels/simd_targets.h"
#include "tests/kernels/synthetic_model.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <vector>

using namespace gsc;
using namespace gsc::test;

namespace {

struct Gaussian {
    double values[14]; // position, scale, rotation, opacity, colour
};

using Strip = std::map<uint32_t, Gaussian>; // by anchor * K + k

struct Decoded {
    std::vector<uint16_t> key;
    std::vector<float> fixed;
};

SyntheticOptions options()
{
    SyntheticOptions options;
    options.anchors = 1500;
    options.n_offsets = 7;
    options.cell_log2 = 6; // one chunk per octant
    options.seed = 3;
    return options;
}

std::vector<VisibleAnchor> anchorsOf(const ModelView& model, uint32_t first, uint32_t count)
{
    REQUIRE(model.chunks[0].anchor_count >= first + count);
    std::vector<VisibleAnchor> anchors;
    for (uint32_t i = 0; i < count; ++i)
        anchors.push_back({0, first + i, 3, {1, 1}});
    return anchors;
}

// Two eyes at once, as the cache decodes them, or one.
std::vector<Decoded> decode(const ModelView& model, const std::vector<VisibleAnchor>& anchors,
                            const std::vector<EyeParams>& eyes)
{
    Buffer<float> bias;
    DecodeScratch scratch;
    reserveDecode(model, scratch);
    const uint32_t K = model.params->n_offsets;
    std::vector<Decoded> decoded(eyes.size());
    std::vector<float> fixed(stripFixedValues(K), -1.0f);
    uint16_t* keys[kMaxEyes] = {};
    for (size_t e = 0; e < eyes.size(); ++e) {
        decoded[e].key.assign(stripKeyValues(K), 0xffff);
        keys[e] = decoded[e].key.data();
    }
    const DecodeArgs args =
        prepareDecode(model, eyes.data(), uint32_t(eyes.size()), anchors.data(), anchors.size(), -1, bias);
    decodeStripCpu(args, uint32_t(anchors.size()), keys, fixed.data(), scratch);
    for (Decoded& eye : decoded)
        eye.fixed = fixed;
    return decoded;
}

Strip mixed(const ModelView& model, const Decoded& a, const Decoded* b, float t, uint32_t lanes, const float* fraction,
            uint32_t first_origin = 0)
{
    DecodeScratch scratch;
    reserveDecode(model, scratch);
    GaussianBlock& block = scratch.blocks[0];
    block.count = 0;
    block.any_positive = false;
    mixStripCpu({{a.key.data(), b != nullptr ? b->key.data() : nullptr},
                 t,
                 a.fixed.data(),
                 fraction,
                 lanes,
                 model.params->n_offsets,
                 first_origin},
                block);
    Strip strip;
    for (uint32_t g = 0; g < block.count; ++g) {
        Gaussian gaussian{};
        double* v = gaussian.values;
        for (int i = 0; i < 3; ++i) {
            v[i] = block.position[i][g];
            v[3 + i] = block.scale[i][g];
            v[11 + i] = block.color[i][g];
        }
        for (int i = 0; i < 4; ++i)
            v[6 + i] = block.rotation[i][g];
        v[10] = block.opacity[g];
        CHECK(strip.emplace(block.origin[g] - first_origin, gaussian).second);
    }
    return strip;
}

Strip reference(const ModelView& model, const std::vector<VisibleAnchor>& anchors, const EyeParams& eye)
{
    Strip strip;
    const Networks nets = findNetworks(model);
    const double center[3] = {eye.center[0], eye.center[1], eye.center[2]};
    std::vector<double> scratch(decodeScratch(*model.params));
    for (uint32_t i = 0; i < anchors.size(); ++i)
        decodeAnchor<double>(model, nets, center, 0, anchors[i].local, 1.0, -1, scratch.data(),
                             [&](const GaussianOf<double>& g) {
                                 const uint32_t K = model.params->n_offsets;
                                 Gaussian gaussian{};
                                 double* v = gaussian.values;
                                 std::copy_n(g.position, 3, v);
                                 std::copy_n(g.scale, 3, v + 3);
                                 std::copy_n(g.rotation, 4, v + 6);
                                 v[10] = g.opacity;
                                 std::copy_n(g.color, 3, v + 11);
                                 strip.emplace(i * K + uint32_t(g.order % K), gaussian);
                             });
    return strip;
}

// Gaussians of `expected` that `actual` lacks or that differ; those at the opacity floor may come or go.
size_t wrong(const Strip& expected, const Strip& actual)
{
    size_t count = 0;
    for (const auto& [origin, gaussian] : expected) {
        const auto found = actual.find(origin);
        if (found == actual.end()) {
            count += gaussian.values[10] > 1.002 * double(kOpacityFloor);
            continue;
        }
        for (int i = 0; i < 14; ++i) {
            const double tolerance = i < 3 ? 1e-5 : 1e-3 * std::max(0.1, std::abs(gaussian.values[i]));
            count += !(std::abs(gaussian.values[i] - found->second.values[i]) < tolerance);
        }
    }
    for (const auto& [origin, gaussian] : actual)
        count += !expected.contains(origin) && gaussian.values[10] > 1.002 * double(kOpacityFloor);
    return count;
}

EyeParams eyeAt(float x)
{
    const float position[3] = {x, 0.2f, -5}, target[3] = {0, 0, 0};
    return lookAt(position, target, 1, 64, 64);
}

} // namespace

TEST_CASE("a kept strip is the scalar decode's in half precision, for one eye and for two, full or short")
{
    const SyntheticModel synthetic(options());
    const ModelView& model = synthetic.view();
    const EyeParams left = eyeAt(0.3f), right = eyeAt(0.9f);
    forEachTarget([&](const char* target) {
        CAPTURE(target);
        for (const uint32_t count : {16u, 12u, 8u, 7u, 1u}) {
            CAPTURE(count);
            const auto anchors = anchorsOf(model, 3, count);
            const auto both = decode(model, anchors, {left, right});
            const auto alone = decode(model, anchors, {right});
            const uint32_t lanes = (1u << count) - 1;
            const Strip expected = reference(model, anchors, left);
            CHECK(expected.size() > count);
            CHECK(wrong(expected, mixed(model, both[0], nullptr, 0, lanes, nullptr)) == 0);
            CHECK(wrong(reference(model, anchors, right), mixed(model, both[1], nullptr, 0, lanes, nullptr)) == 0);
            CHECK(wrong(reference(model, anchors, right), mixed(model, alone[0], nullptr, 0, lanes, nullptr)) == 0);
        }
    });
}

TEST_CASE("lanes choose anchors, factors dim them, origins start where they are told")
{
    const SyntheticModel synthetic(options());
    const ModelView& model = synthetic.view();
    const uint32_t K = model.params->n_offsets;
    const auto anchors = anchorsOf(model, 0, 16);
    const auto decoded = decode(model, anchors, {eyeAt(0.3f)});
    const Strip all = mixed(model, decoded[0], nullptr, 0, 0xffff, nullptr);
    float fraction[kStripAnchors];
    for (uint32_t i = 0; i < kStripAnchors; ++i)
        fraction[i] = i % 3 == 0 ? 0.0f : 0.5f;
    const Strip some = mixed(model, decoded[0], nullptr, 0, 0x0ff5, fraction, 5 * K * kStripAnchors);
    size_t expected = 0;
    for (const auto& [origin, gaussian] : all) {
        const uint32_t anchor = origin / K;
        const double opacity = gaussian.values[10] * double(fraction[anchor]);
        const bool drawn = (0x0ff5u >> anchor & 1) && opacity >= double(kOpacityFloor);
        expected += drawn;
        REQUIRE(some.contains(origin) == drawn);
        if (drawn)
            CHECK(some.at(origin).values[10] == doctest::Approx(opacity));
    }
    CHECK(some.size() == expected);
    CHECK(expected > 5);
}

TEST_CASE("between two keys a strip is nearer to the truth than either, and the keys are met at the ends")
{
    const SyntheticModel synthetic(options());
    const ModelView& model = synthetic.view();
    const auto anchors = anchorsOf(model, 0, 16);
    const auto keys = decode(model, anchors, {eyeAt(0), eyeAt(0.2f)});
    CHECK(wrong(reference(model, anchors, eyeAt(0.2f)), mixed(model, keys[0], &keys[1], 1, 0xffff, nullptr)) == 0);
    const auto distance = [](const Strip& a, const Strip& b) {
        double sum = 0;
        for (const auto& [origin, gaussian] : a)
            for (int i = 3; i < 14 && b.contains(origin); ++i) {
                const double d = gaussian.values[i] - b.at(origin).values[i];
                sum += d * d;
            }
        return std::sqrt(sum);
    };
    const Strip truth = reference(model, anchors, eyeAt(0.1f));
    const double between = distance(truth, mixed(model, keys[0], &keys[1], 0.5f, 0xffff, nullptr));
    CHECK(between < 0.25 * distance(truth, mixed(model, keys[0], nullptr, 0, 0xffff, nullptr)));
    CHECK(between < 0.25 * distance(truth, mixed(model, keys[1], nullptr, 0, 0xffff, nullptr)));
    // and on beyond the second
    const Strip beyond = reference(model, anchors, eyeAt(0.25f));
    CHECK(distance(beyond, mixed(model, keys[0], &keys[1], 1.25f, 0xffff, nullptr)) <
          distance(beyond, mixed(model, keys[1], nullptr, 0, 0xffff, nullptr)));
}
