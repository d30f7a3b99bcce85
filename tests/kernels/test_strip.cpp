// SPDX-License-Identifier: Apache-2.0
// Kept strips against the scalar decode: one key, two keys, lanes, factors, short strips, and what is packed of them.
#include <gsc/half.h>
#include "kernels/reuse/packed_strip.h"
#include "kernels/math/eye.h"
#include "tests/kernels/simd_targets.h"
#include "tests/kernels/synthetic_model.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <map>
#include <memory>
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
    uint32_t count;
};

struct AlignedFree {
    void operator()(std::byte* p) const { std::free(p); }
};
using Packed = std::unique_ptr<std::byte, AlignedFree>;

SyntheticOptions options()
{
    SyntheticOptions options{.anchors = 1500, .n_offsets = 7};
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
    for (Decoded& eye : decoded) {
        eye.fixed = fixed;
        eye.count = uint32_t(anchors.size());
    }
    return decoded;
}

// Filled with what a strip before it may have left.
Packed packedStrip(uint32_t n_offsets, const Decoded& a, const Decoded* b, PackedExtent* extent = nullptr)
{
    const size_t bytes = packedStripBytes(n_offsets);
    Packed packed(static_cast<std::byte*>(std::aligned_alloc(64, bytes)));
    std::fill_n(packed.get(), bytes, std::byte{0xff});
    PackScratch scratch;
    reservePack(n_offsets, scratch);
    const PackedExtent read =
        packStripCpu({{a.key.data(), b != nullptr ? b->key.data() : nullptr}, a.fixed.data(), a.count, n_offsets},
                     scratch, packed.get());
    CHECK(read.one <= read.two);
    CHECK(read.two <= bytes);
    if (extent != nullptr)
        *extent = read;
    return packed;
}

Strip gaussians(const GaussianBlock& block, uint32_t first_origin)
{
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

Strip mixed(const ModelView& model, const Decoded& a, const Decoded* b, float t, uint32_t lanes, const float* fraction,
            uint32_t first_origin = 0)
{
    DecodeScratch scratch;
    reserveDecode(model, scratch);
    GaussianBlock& block = scratch.blocks[0];
    block.count = 0;
    block.any_positive = false;
    const Packed packed = packedStrip(model.params->n_offsets, a, b);
    mixStripCpu({packed.get(), t, fraction, lanes, model.params->n_offsets, first_origin}, block);
    return gaussians(block, first_origin);
}

Strip reference(const ModelView& model, const std::vector<VisibleAnchor>& anchors, const EyeParams& eye)
{
    Strip strip;
    const double center[3] = {eye.center[0], eye.center[1], eye.center[2]};
    std::vector<double> scratch(decodeScratch(*model.params));
    for (uint32_t i = 0; i < anchors.size(); ++i)
        decodeAnchor<double>(model, center, 0, anchors[i].local, 1.0, -1, scratch.data(),
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
            // scales are rounded twice, and without instructions for halves rounding cuts off
            const double half = i < 6 ? 2e-3 : 1e-3;
            const double tolerance = i < 3 ? 1e-5 : half * std::max(0.1, std::abs(gaussian.values[i]));
            count += !(std::abs(gaussian.values[i] - found->second.values[i]) < tolerance);
        }
    }
    for (const auto& [origin, gaussian] : actual)
        count += !expected.contains(origin) && gaussian.values[10] > 1.002 * double(kOpacityFloor);
    return count;
}

// That `drawn`, between the keys a and b at b, is b but for a step of what changes from a to b (SecondCell).
void checkSecond(const Strip& a, const Strip& b, const Strip& drawn)
{
    const auto relative = [](const double* v, int i) { return i >= 3 && i < 6 ? 1 / std::max(v[i], 1e-9) : 1.0; };
    double largest[14] = {};
    for (const auto& [origin, gaussian] : a)
        for (int i = 0; i < 14 && b.contains(origin); ++i)
            largest[i] = std::max(largest[i],
                                  std::abs(gaussian.values[i] - b.at(origin).values[i]) * relative(gaussian.values, i));
    for (const auto& [from, to] : {std::pair{3, 6}, {6, 10}, {11, 14}})
        std::fill(largest + from, largest + to, *std::max_element(largest + from, largest + to));
    CHECK(b.size() > 50);
    for (const auto& [origin, gaussian] : b) {
        CAPTURE(origin);
        const double* expected = gaussian.values;
        REQUIRE((drawn.contains(origin) || expected[10] < 1.002 * double(kOpacityFloor)));
        for (int i = 0; i < 14 && drawn.contains(origin) && a.contains(origin); ++i) {
            CAPTURE(i);
            const double step = largest[i] / 127 / relative(a.at(origin).values, i);
            CHECK(std::abs(drawn.at(origin).values[i] - expected[i]) <
                  0.55 * step + 1e-3 * std::abs(expected[i]) + 5e-4);
        }
    }
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

TEST_CASE("an anchor that the camera lies on draws nothing, from either key")
{
    const SyntheticModel synthetic(options());
    const ModelView& model = synthetic.view();
    const auto anchors = anchorsOf(model, 0, 16);
    const uint32_t K = model.params->n_offsets;
    EyeParams on = eyeAt(0.3f);
    const Vec3<float> p = anchorPosition(model, 0, 5);
    const float center[3] = {p.x, p.y, p.z};
    std::copy_n(center, 3, on.center);
    forEachTarget([&](const char* target) {
        CAPTURE(target);
        const auto keys = decode(model, anchors, {eyeAt(0.3f), on});
        for (const Strip& strip : {mixed(model, keys[1], nullptr, 0, 0xffff, nullptr),
                                   mixed(model, keys[0], &keys[1], 0.5f, 0xffff, nullptr)}) {
            CHECK(strip.size() > 16);
            for (const auto& [origin, gaussian] : strip) {
                CHECK(origin / K != 5);
                for (const double v : gaussian.values)
                    CHECK(std::isfinite(v));
            }
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
    CHECK(wrong(reference(model, anchors, eyeAt(0)), mixed(model, keys[0], &keys[1], 0, 0xffff, nullptr)) == 0);
    checkSecond(mixed(model, keys[0], nullptr, 0, 0xffff, nullptr), mixed(model, keys[1], nullptr, 0, 0xffff, nullptr),
                mixed(model, keys[0], &keys[1], 1, 0xffff, nullptr));
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

namespace {

uint16_t half(float v)
{
    return uint16_t(floatToHalfUp(std::abs(v)) | (v < 0 ? 0x8000 : 0));
}

// A key made by hand: opacity as told, colour and sigmoid of the scale of all Gaussians alike.
Decoded madeKey(uint32_t n_offsets, const std::function<float(uint32_t k, uint32_t anchor)>& opacity,
                float color = 0.5f, const std::function<float(uint32_t k, uint32_t anchor)>& scale = nullptr)
{
    Decoded made{std::vector<uint16_t>(stripKeyValues(n_offsets)),
                 std::vector<float>(stripFixedValues(n_offsets), 1.0f), kStripAnchors};
    for (uint32_t k = 0; k < n_offsets; ++k)
        for (uint32_t anchor = 0; anchor < kStripAnchors; ++anchor) {
            const auto put = [&](uint32_t row, float v) {
                made.key[(size_t(k) * kStripRows + row) * kStripAnchors + anchor] = half(v);
            };
            put(kOpacityRow, opacity(k, anchor));
            for (uint32_t i = 0; i < 3; ++i) {
                put(kColorRow + i, color);
                put(kScaleRow + i, scale ? scale(k, anchor) : 0.25f);
            }
            put(kRotationRow, 1);
        }
    return made;
}

struct Drawn {
    Strip strip;
    bool any_positive;
};

Drawn drawn(uint32_t n_offsets, const Packed& packed, float t, uint32_t lanes = 0xffff, const float* fraction = nullptr)
{
    const size_t values = size_t(n_offsets + 1) * kStripAnchors;
    std::vector<float> floats(14 * values);
    std::vector<uint16_t> origins(values);
    GaussianBlock block{};
    float* next = floats.data();
    const auto take = [&](float*& p) { p = next, next += values; };
    for (auto* group : {block.position, block.scale, block.color})
        for (int i = 0; i < 3; ++i)
            take(group[i]);
    for (float*& p : block.rotation)
        take(p);
    take(block.opacity);
    block.origin = origins.data();
    mixStripCpu({packed.get(), t, fraction, lanes, n_offsets, 0}, block);
    return {gaussians(block, 0), block.any_positive};
}

} // namespace

TEST_CASE("a Gaussian that cannot show is not packed, one that comes to life on the way is there when it does")
{
    constexpr uint32_t K = 3;
    // anchor 1: rises on the way; 2: falls; 3: shows only beyond the second key; 4: never, though above zero;
    // 5, 6: seen from the anchor itself; 7: shows only before the first key
    const float a[kStripAnchors] = {0.5f, -0.5f, 0.5f, -0.02f, 0.003f, kNoOpacity, 0.5f, 0.001f},
                b[kStripAnchors] = {0.5f, 0.5f, -0.5f, 0.001f, 0.003f, 0.5f, kNoOpacity, -0.02f};
    const auto first = madeKey(K, [&](uint32_t k, uint32_t i) { return k == 1 ? a[i] : -1.0f; });
    const auto last = madeKey(K, [&](uint32_t k, uint32_t i) { return k == 1 ? b[i] : -1.0f; });
    forEachTarget([&](const char* target) {
        CAPTURE(target);
        PackedExtent extent;
        const Packed packed = packedStrip(K, first, &last, &extent);
        CHECK(extent.one == sizeof(PackedStrip) + sizeof(FirstCell));
        CHECK(extent.two == extent.one + sizeof(SecondCell));
        const auto shown = [&](float t) {
            uint32_t bits = 0;
            for (const auto& [origin, gaussian] : drawn(K, packed, t).strip) {
                CHECK(origin % K == 1);
                const uint32_t anchor = origin / K;
                CHECK(gaussian.values[10] ==
                      doctest::Approx(double(a[anchor] + t * (b[anchor] - a[anchor]))).epsilon(0.01));
                bits |= 1u << anchor;
            }
            return bits;
        };
        CHECK(shown(kLeastMix) == 0b10000101);
        CHECK(shown(0) == 0b00101);
        CHECK(shown(0.25f) == 0b00101);
        CHECK(shown(0.75f) == 0b00011);
        CHECK(shown(1) == 0b00011);
        CHECK(shown(kMostMix) == 0b01011);

        const Packed none = packedStrip(K, madeKey(K, [](uint32_t, uint32_t) { return -0.1f; }), nullptr, &extent);
        CHECK(extent.one == sizeof(PackedStrip));
        CHECK(extent.two == extent.one);
        CHECK(drawn(K, none, 0).strip.empty());
        CHECK_FALSE(drawn(K, none, 0).any_positive);
    });
}

TEST_CASE("an opacity above zero is known of though nothing is packed of it")
{
    constexpr uint32_t K = 2;
    const auto only = [](uint32_t anchor) {
        return madeKey(K, [=](uint32_t k, uint32_t i) { return k == 1 && i == anchor ? 0.001f : -0.5f; });
    };
    const Decoded third = only(3), ninth = only(9);
    const Packed packed = packedStrip(K, third, &ninth);
    CHECK(drawn(K, packed, 0, 1u << 3).any_positive);
    CHECK_FALSE(drawn(K, packed, 0, 1u << 9).any_positive);
    CHECK(drawn(K, packed, 0.5f, 1u << 9).any_positive);
    CHECK_FALSE(drawn(K, packed, 0.5f, 0xffffu & ~(1u << 3 | 1u << 9)).any_positive);
    float fraction[kStripAnchors] = {};
    CHECK_FALSE(drawn(K, packed, 0, 0xffff, fraction).any_positive);
    fraction[3] = 0.5f;
    CHECK(drawn(K, packed, 0, 0xffff, fraction).any_positive);
}

TEST_CASE("a Gaussian that grows from nothing leaves the steps of its neighbours fine")
{
    constexpr uint32_t K = 1;
    const auto opaque = [](uint32_t, uint32_t) { return 0.5f; };
    const auto sizes = [](float grown, float rest) {
        return [=](uint32_t, uint32_t i) { return i == 5 ? grown : rest; };
    };
    const Decoded small = madeKey(K, opaque, 0.5f, sizes(0, 0.25f)),
                  large = madeKey(K, opaque, 0.5f, sizes(0.9f, 0.28f));
    const Strip strip = drawn(K, packedStrip(K, small, &large), 1).strip;
    REQUIRE(strip.size() == kStripAnchors);
    for (const auto& [origin, gaussian] : strip) {
        CAPTURE(origin);
        CHECK(gaussian.values[3] == doctest::Approx(origin == 5 ? 0.9 : 0.28).epsilon(0.013));
    }
}
