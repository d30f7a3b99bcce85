// SPDX-License-Identifier: Apache-2.0
// Decode and projection on the device, the matrix units and both kernels in fp32, against the scalar reference.
#include "kernels/math/blend.h"
#include "tests/kernels/gpu_decode.h"

#include <doctest/doctest.h>

#include <cstring>

using namespace gsc;
using namespace gsc::test;

namespace {

// Tolerance of networks that halves hold exactly. Only outputs are rounded: colour and opacity to half a step of
// 1/65535.
constexpr DecodeTolerance kFastExactNetworks{3e-4, 2e-5, 1.6e-5, 1.6e-5, 1e-6};
// Tolerance of equal arithmetic, but that exp and tanh of a device and of a C library differ in their last bits, which
// move a position by an ulp. Covariances: what their inverse in fp32 leaves of them, 4e-6 where the functions are the
// same.
constexpr DecodeTolerance kExact{1e-3, 2e-5, 1e-6, 1e-6, 5e-6};

const std::vector<EyeParams> kOneEye = {eyeAt(0.4f, -5, 150, 110)};
const std::vector<EyeParams> kTwoEyes = {eyeAt(0.4f, -5, 150, 110), eyeAt(1.9f, -4, 97, 143)};

SyntheticOptions someModel(uint32_t anchors)
{
    SyntheticOptions options{.anchors = anchors, .log_scale = -2.6f};
    return options;
}

template <typename Splat>
constexpr DecodeTolerance kTolerance = std::is_same_v<Splat, PackedSplat> ? kFast : kExact;

template <typename Splat>
uint32_t checkDecode(const DecodeJob& job, const DecodeTolerance& tolerance = kTolerance<Splat>)
{
    const Decoded<Splat> decoded = decodeOnDevice<Splat>(job);
    CHECK(decoded.counters.overflow == 0);
    checkSplats(job, decoded, tolerance);
    return uint32_t(decoded.eyes[0].size() + decoded.eyes[1].size());
}

template <typename Splat>
void checkCounts()
{
    const SyntheticModel synthetic(someModel(700));
    StageModel model(synthetic.view());
    for (const uint32_t count : {0u, 1u, 15u, 16u, 17u, 31u, 32u, 33u, 127u, 129u, 255u, 257u, 700u})
        for (const auto& eyes : {kOneEye, kTwoEyes}) {
            CAPTURE(count);
            CAPTURE(eyes.size());
            const uint32_t splats = checkDecode<Splat>(decodeJob(synthetic.view(), model, eyes, count));
            CHECK((count < 100 ? splats <= 2 * count * synthetic.view().params->n_offsets : splats > 2 * count));
        }
}

template <typename Splat>
void checkInputs()
{
    for (const uint32_t inputs : {0u, uint32_t(kMlpTakesDistance), uint32_t(kMlpTakesLevel),
                                  kMlpTakesDistance | kMlpTakesLevel | kMlpTakesAppearance}) {
        CAPTURE(inputs);
        SyntheticOptions options = someModel(200);
        options.inputs = inputs;
        options.levels = 4;
        options.flags = kModelHasLevels;
        options.level_rule = LevelRule::Progressive;
        options.encoding = inputs == 0 ? PositionEncoding::Float : PositionEncoding::Grid;
        options.raster_rules = inputs == kMlpTakesDistance ? RasterRules::Gsplat : RasterRules::DiffGaussian;
        if (inputs & kMlpTakesAppearance) {
            options.appearance_dim = 8;
            options.appearance_rows = 3;
        }
        const SyntheticModel synthetic(options);
        StageModel model(synthetic.view());
        DecodeJob job = decodeJob(synthetic.view(), model, kTwoEyes, 200);
        for (int row = options.appearance_dim > 0 ? 0 : -1; row < int(options.appearance_rows); ++row) {
            job.appearance = row;
            CHECK(checkDecode<Splat>(job) > 300);
        }
        Random random(5);
        for (size_t i = 0; i < 2 * job.visible.size(); ++i)
            job.fraction.push_back(random.uniform());
        CHECK(checkDecode<Splat>(job) > 200);
        job.grid = gridOf(kTwoEyes, 32, 5);
        cutIntoPasses(job, 1);
        CHECK(checkDecode<Splat>(job) > 200);
    }
}

// A model all of whose Gaussians are far above 1/255, so that none is in doubt.
SyntheticModel opaqueModel(SyntheticOptions options, const SyntheticAnchors& anchors)
{
    std::vector<Mlp> mlps = randomMlps(options);
    for (float& bias : mlps[0].layers[1].bias)
        bias += 12;
    return SyntheticModel(syntheticParams(options), anchors, mlps, {}, 0);
}

template <typename Splat>
void checkNotFinite()
{
    const SyntheticOptions options = someModel(300);
    const uint32_t F = options.feat_dim, K = options.n_offsets;
    const SyntheticAnchors whole = randomAnchors(options);
    SyntheticAnchors broken = whole;
    for (uint32_t i = 0; i < 300; i += 7)
        broken.feature[size_t(i) * F + i % F] = NAN;
    for (uint32_t i = 3; i < 300; i += 7)
        broken.offset[size_t(i) * 3 * K + i % (3 * K)] = NAN;
    const SyntheticModel sound = opaqueModel(options, whole), synthetic = opaqueModel(options, broken);
    StageModel sound_model(sound.view()), model(synthetic.view());
    const DecodeJob job = decodeJob(synthetic.view(), model, kTwoEyes, 300);
    const Decoded<Splat> decoded = decodeOnDevice<Splat>(job);
    checkSplats(job, decoded, kTolerance<Splat>);
    const Decoded<Splat> untouched = decodeOnDevice<Splat>(decodeJob(sound.view(), sound_model, kTwoEyes, 300));
    for (uint32_t e = 0; e < 2; ++e) {
        // a NaN drops its own anchor or Gaussian, and changes no bit of its neighbours in the tile
        CHECK(decoded.counters.dropped[e] == decodeOnHost(job, e).dropped);
        CHECK(decoded.counters.dropped[e] > 20);
        uint32_t changed = 0, expected = 0;
        for (const auto& [order, splat] : untouched.eyes[e]) {
            const auto i = uint32_t(order / K), k = uint32_t(order % K);
            const bool hit = i % 7 == 0 || (i % 7 == 3 && i % (3 * K) / 3 == k);
            // note: an anchor's steps are its largest offset's, which the NaN replaces
            if (hit || i % 7 == 3)
                continue;
            ++expected;
            const auto at = decoded.eyes[e].find(order);
            changed += at == decoded.eyes[e].end() || !sameSplat(at->second, splat);
        }
        CHECK(changed == 0);
        CHECK(expected > 500);
        for (const auto& [order, splat] : decoded.eyes[e])
            changed += order / K % 7 == 0;
        CHECK(changed == 0);
    }
}

template <typename Splat>
void checkCapacity()
{
    const SyntheticModel synthetic(someModel(150));
    StageModel model(synthetic.view());
    DecodeJob job = decodeJob(synthetic.view(), model, kTwoEyes, 150);
    const Decoded<Splat> all = decodeOnDevice<Splat>(job);
    const auto needed = uint32_t(std::max(all.eyes[0].size(), all.eyes[1].size()));
    REQUIRE(needed > 300);
    for (const uint32_t capacity : {needed - 1, needed / 2, 129u, 128u, 127u, 1u, 0u}) {
        CAPTURE(capacity);
        job.slot_capacity = capacity;
        const Decoded<Splat> cut = decodeOnDevice<Splat>(job);
        CHECK(cut.counters.overflow == kSlotOverflow);
        for (uint32_t e = 0; e < 2; ++e) {
            CHECK(cut.counters.pass.slots[e] >= all.eyes[e].size()); // number that the slots grow to
            CHECK(cut.eyes[e].size() <= capacity);
            for (const auto& [order, splat] : cut.eyes[e]) {
                const auto at = all.eyes[e].find(order);
                CHECK((at != all.eyes[e].end() && sameSplat(at->second, splat)));
            }
        }
    }
}

template <typename Splat>
void checkPasses(bool broken)
{
    SyntheticOptions options = someModel(400);
    options.log_scale = -1.6f; // so that anchors reach into several passes
    SyntheticAnchors anchors = randomAnchors(options);
    if (broken)
        for (size_t i = 0; i < anchors.offset.size(); i += 97)
            anchors.offset[i] = i % 2 == 0 ? NAN : INFINITY;
    const SyntheticModel synthetic(syntheticParams(options), anchors, randomMlps(options), {}, 0);
    StageModel model(synthetic.view());
    DecodeJob job = decodeJob(synthetic.view(), model, kTwoEyes, 400);
    const Decoded<Splat> all = decodeOnDevice<Splat>(job);
    for (const uint32_t passes : {2u, 3u, 7u}) {
        CAPTURE(passes);
        cutIntoPasses(job, passes);
        Decoded<Splat> sum{};
        uint32_t twice = 0, empty = 0, listed = 0;
        for (job.pass = 0; job.pass < passes; ++job.pass) {
            Decoded<Splat> part = decodeOnDevice<Splat>(job);
            CHECK(part.counters.overflow == 0);
            listed += part.counters.pass.anchors_listed;
            for (uint32_t e = 0; e < 2; ++e) {
                empty += part.eyes[e].empty();
                for (const auto& emitted : part.eyes[e])
                    twice += !sum.eyes[e].insert(emitted).second;
                sum.counters.gaussians[e] += part.counters.gaussians[e];
                sum.counters.dropped[e] += part.counters.dropped[e];
                sum.counters.any_positive[e] |= part.counters.any_positive[e];
            }
        }
        CHECK(twice == 0);
        CHECK(empty < passes);
        CHECK(listed > job.visible.size()); // some reach into two
        CHECK(listed < (passes + 1) * job.visible.size() / 2);
        for (uint32_t e = 0; e < 2; ++e) {
            CHECK(sum.counters.gaussians[e] == all.counters.gaussians[e]);
            CHECK(sum.counters.dropped[e] == all.counters.dropped[e]);
            CHECK(sum.counters.any_positive[e] == all.counters.any_positive[e]);
            CHECK(sum.eyes[e].size() == all.eyes[e].size());
            uint32_t differ = 0;
            for (const auto& [order, splat] : all.eyes[e]) {
                const auto at = sum.eyes[e].find(order);
                differ += at == sum.eyes[e].end() || !sameSplat(at->second, splat);
            }
            CHECK(differ == 0);
        }
    }
}

} // namespace

TEST_CASE("decode fast: counts of anchors around a warp's 16 and a block's 128")
{
    checkCounts<PackedSplat>();
}

TEST_CASE("decode exact: counts of anchors around a block")
{
    checkCounts<ExactSplat>();
}

TEST_CASE("decode: numbers of Gaussians per anchor; what the matrix units cannot take, the scalar kernel does")
{
    for (const uint32_t offsets : {1u, 3u, 4u, 5u, 9u, 12u}) {
        CAPTURE(offsets);
        SyntheticOptions options = someModel(150);
        options.n_offsets = offsets;
        const SyntheticModel synthetic(options);
        StageModel model(synthetic.view());
        const DecodeJob job = decodeJob(synthetic.view(), model, kTwoEyes, 150);
        CHECK(checkDecode<PackedSplat>(job) > 20 * offsets);
        CHECK(checkDecode<ExactSplat>(job) > 20 * offsets);
    }
    // the last does not fit into a thread's own memory
    for (const auto& shape : {std::pair<uint32_t, uint32_t>{32, 13}, {16, 10}, {64, 10}, {128, 40}}) {
        CAPTURE(shape.first);
        SyntheticOptions options = someModel(60);
        options.feat_dim = shape.first;
        options.n_offsets = shape.second;
        const SyntheticModel synthetic(options);
        StageModel model(synthetic.view());
        CHECK(checkDecode<ExactSplat>(decodeJob(synthetic.view(), model, kTwoEyes, 60)) > 100);
    }
}

TEST_CASE("decode: distance, level and appearance inputs, fractions, float positions, both rasterisers")
{
    checkInputs<PackedSplat>();
    checkInputs<ExactSplat>();
}

TEST_CASE("decode: feature bank of any inputs, beside heads that have them or not, and rotations of the anchors' own")
{
    for (const uint32_t bank :
         {0u, uint32_t(kModelBankDistance), uint32_t(kModelBankLevel), kModelBankDistance | kModelBankLevel})
        for (const uint32_t inputs : {0u, kMlpTakesDistance | kMlpTakesLevel}) {
            CAPTURE(bank);
            CAPTURE(inputs);
            SyntheticOptions options = someModel(200);
            options.inputs = inputs;
            options.levels = 4;
            options.flags = kModelHasLevels | kModelFeatureBank | bank;
            options.level_rule = LevelRule::Round;
            SyntheticAnchors anchors = randomAnchors(options);
            Random random(9);
            for (uint32_t i = 0; i < 4 * options.anchors; ++i)
                anchors.rotation.push_back(random.normal());
            const SyntheticModel synthetic(syntheticParams(options), anchors, randomMlps(options), {}, 0);
            StageModel model(synthetic.view());
            REQUIRE(model.scene.fastPossible());
            const DecodeJob job = decodeJob(synthetic.view(), model, kTwoEyes, 200);
            CHECK(checkDecode<PackedSplat>(job) > 300);
            CHECK(checkDecode<ExactSplat>(job) > 300);
        }
}

TEST_CASE("decode: masked slots draw nothing and count as nothing, in tiles and one by one")
{
    for (const uint32_t offsets : {10u, 12u}) { // 12: one thread per anchor and eye in `exact`
        CAPTURE(offsets);
        SyntheticOptions options = someModel(300);
        options.n_offsets = offsets;
        options.flags |= kModelMaskedSlots;
        SyntheticAnchors anchors = randomAnchors(options);
        maskSlots(anchors, offsets);
        const SyntheticModel synthetic = opaqueModel(options, anchors);
        StageModel model(synthetic.view());
        const auto check = [&]<typename Splat>(const Splat*) {
            const DecodeJob job = decodeJob(synthetic.view(), model, kTwoEyes, 300);
            const Decoded<Splat> decoded = decodeOnDevice<Splat>(job);
            checkSplats(job, decoded, kTolerance<Splat>);
            for (uint32_t e = 0; e < 2; ++e) {
                CHECK(decoded.counters.dropped[e] == 0);
                CHECK(decoded.counters.gaussians[e] == decodeOnHost(job, e).gaussians.size());
                CHECK(decoded.eyes[e].size() > 300);
                for (const auto& [order, splat] : decoded.eyes[e])
                    CHECK(!isSlotMasked(uint32_t(order / offsets), uint32_t(order % offsets)));
            }
        };
        check(static_cast<const PackedSplat*>(nullptr));
        check(static_cast<const ExactSplat*>(nullptr));
    }
}

TEST_CASE("decode: a compact model is held in fewer bytes and decodes as the same model that is not")
{
    for (const float spread : {1.0f, 1e-4f, 4.0f}) { // spread of its features
        CAPTURE(spread);
        SyntheticOptions options = someModel(300);
        options.flags |= kModelMaskedSlots;
        SyntheticAnchors anchors = randomAnchors(options);
        for (float& v : anchors.feature)
            v *= spread;
        std::fill_n(anchors.feature.begin() + 5 * options.feat_dim, options.feat_dim, 0.0f);
        makeCompact(anchors, options);
        maskSlots(anchors, options.n_offsets);
        SyntheticOptions compact = options;
        compact.flags |= kModelCompact;
        const SyntheticModel plain = opaqueModel(options, anchors), synthetic = opaqueModel(compact, anchors);
        StageModel plain_model(plain.view()), model(synthetic.view());
        CHECK(model.scene.model().feature == nullptr);
        CHECK(plain_model.scene.model().compact_feature == nullptr);
        // 200 and 112 bytes an anchor, in pieces of 256
        CHECK(plain_model.budget.used - model.budget.used >= uint64_t(300) * (200 - 112) - 4 * 256);
        const DecodeJob job = decodeJob(synthetic.view(), model, kTwoEyes, 300),
                        plain_job = decodeJob(plain.view(), plain_model, kTwoEyes, 300);
        DecodeTolerance tolerance = kFast; // either of them has 2.1e-2
        tolerance.covariance = 2.5e-2;
        CHECK(checkDecode<PackedSplat>(plain_job, tolerance) > 300);
        CHECK(checkDecode<PackedSplat>(job, tolerance) > 300);
        const auto exact = decodeOnDevice<ExactSplat>(job), wanted = decodeOnDevice<ExactSplat>(plain_job);
        for (uint32_t e = 0; e < 2; ++e) {
            CHECK(exact.eyes[e].size() > 300);
            CHECK(exact.eyes[e].size() == wanted.eyes[e].size());
            CHECK(exact.counters.dropped[e] == 0);
            uint32_t others = 0;
            for (const auto& [order, splat] : exact.eyes[e]) {
                const auto found = wanted.eyes[e].find(order);
                others += found == wanted.eyes[e].end() || !sameSplat(splat, found->second);
            }
            CHECK(others == 0);
        }
    }
}

TEST_CASE("decode fast: features that no half holds stay numbers, of a compact model too")
{
    SyntheticOptions options = someModel(300);
    SyntheticAnchors anchors = randomAnchors(options);
    for (float& v : anchors.feature)
        v *= 1e5f;
    makeCompact(anchors, options);
    for (const uint32_t flags : {0u, uint32_t(kModelCompact)}) {
        CAPTURE(flags);
        options.flags = flags;
        const SyntheticModel synthetic = opaqueModel(options, anchors);
        StageModel model(synthetic.view());
        const auto decoded = decodeOnDevice<PackedSplat>(decodeJob(synthetic.view(), model, kTwoEyes, 300));
        for (uint32_t e = 0; e < 2; ++e) {
            CHECK(decoded.counters.dropped[e] == 0);
            CHECK(decoded.counters.gaussians[e] > 300);
        }
    }
}

TEST_CASE("decode fast: networks that halves hold exactly give the reference's values")
{
    SyntheticOptions options = someModel(300);
    SyntheticAnchors anchors = randomAnchors(options);
    std::vector<Mlp> mlps = randomMlps(options);
    // features of 1/4 and weights of 1/16 make hidden values of 1/64 below 32, which are halves, as long as the
    // direction stays out
    const auto toGrid = [](float v, float steps, float largest) {
        return std::clamp(std::round(v * steps), -largest * steps, largest * steps) / steps;
    };
    for (float& v : anchors.feature)
        v = toGrid(v, 4, 2);
    for (Mlp& mlp : mlps) {
        for (size_t i = 0; i < mlp.layers[0].weight.size(); ++i)
            mlp.layers[0].weight[i] =
                i % mlp.layers[0].in < options.feat_dim ? toGrid(mlp.layers[0].weight[i], 16, 0.4375f) : 0.0f;
        for (float& v : mlp.layers[0].bias)
            v = toGrid(v, 64, 1);
        for (float& v : mlp.layers[1].weight)
            v = toGrid(v, 64, 1);
        for (float& v : mlp.layers[1].bias)
            v = toGrid(v, 64, 1);
    }
    const SyntheticModel synthetic(syntheticParams(options), anchors, mlps, {}, 0);
    StageModel model(synthetic.view());
    CHECK(checkDecode<PackedSplat>(decodeJob(synthetic.view(), model, kTwoEyes, 300), kFastExactNetworks) > 500);
}

TEST_CASE("decode fast: what rounding a direction or a distance to a half would cost is not paid")
{
    SyntheticOptions options = someModel(300);
    options.inputs = kMlpTakesDistance;
    options.extent = 0.02f;
    options.encoding = PositionEncoding::Float;
    options.log_scale = -4;
    const EyeParams& eye = kOneEye[0];
    const double length = std::sqrt(double(eye.center[0]) * eye.center[0] + double(eye.center[1]) * eye.center[1] +
                                    double(eye.center[2]) * eye.center[2]);
    // the hidden units are differences of large products that nearly cancel over so small a model
    std::vector<Mlp> mlps = randomMlps(options);
    for (Mlp& mlp : mlps)
        for (uint32_t unit = 0; unit < mlp.layers[0].out; ++unit) {
            float* weight = mlp.layers[0].weight.data() + size_t(unit) * mlp.layers[0].in;
            std::fill_n(weight, mlp.layers[0].in, 0.0f);
            const uint32_t axis = unit % 4; // the last is the distance
            const float steep = axis < 3 ? 256.0f : 32.0f, sign = unit % 8 < 4 ? 1.0f : -1.0f;
            const double middle = axis < 3 ? -double(eye.center[axis]) / length : length;
            weight[options.feat_dim + axis] = sign * steep;
            mlp.layers[0].bias[unit] = float(-sign * steep * middle) + 0.25f;
        }
    const SyntheticModel synthetic(syntheticParams(options), randomAnchors(options), mlps, {}, 0);
    StageModel model(synthetic.view());
    CHECK(checkDecode<PackedSplat>(decodeJob(synthetic.view(), model, kOneEye, 300)) > 500);
}

TEST_CASE("decode exact: the bins of a needle hold what it draws along its ridge")
{
    SyntheticOptions options = someModel(200);
    SyntheticAnchors anchors = randomAnchors(options);
    for (uint32_t i = 0; i < 200; ++i)
        for (uint32_t axis = 0; axis < 3; ++axis) // hundreds of pixels by none
            anchors.scale[6 * i + 3 + axis] = axis == 0 ? 1.0f : -20.0f;
    const SyntheticModel synthetic = opaqueModel(options, anchors);
    StageModel model(synthetic.view());
    const std::vector<EyeParams> eyes = {eyeAt(0.4f, -5, 4000, 3000)};
    const Decoded<ExactSplat> decoded = decodeOnDevice<ExactSplat>(decodeJob(synthetic.view(), model, eyes, 200));
    uint32_t needles = 0, outside = 0;
    for (const auto& [order, emitted] : decoded.eyes[0]) {
        const ExactSplat& s = emitted.splat;
        const BinBox box = unpackBox(emitted.place.box);
        needles += s.conic[0] * s.conic[2] - s.conic[1] * s.conic[1] < 1e-4f * s.conic[0] * s.conic[2] ? 1u : 0u;
        const auto check = [&](float x, float y) {
            const float power = gaussianPower(s.conic, s.x - x, s.y - y);
            if (x < 0 || y < 0 || x > 3999 || y > 2999 || x < s.tx0 * 16 || x >= s.tx1 * 16 || y < s.ty0 * 16 ||
                y >= s.ty1 * 16 || power > 0 || s.opacity * std::exp(power) < kOpacityFloor)
                return;
            const uint32_t column = uint32_t(x) / kBinWidth, row = uint32_t(y) / 16;
            outside += column < box.x0 || column > box.x1 || row < box.y0 || row > box.y1 ? 1u : 0u;
        };
        for (float y = 0; y < 3000; ++y) // the nearest pixels to the ridge, row by row, column by column
            for (const float side : {0.0f, 1.0f})
                check(std::floor(s.x + s.conic[1] * (s.y - y) / s.conic[0]) + side, y);
        for (float x = 0; x < 4000; ++x)
            for (const float side : {0.0f, 1.0f})
                check(x, std::floor(s.y + s.conic[1] * (s.x - x) / s.conic[2]) + side);
    }
    CHECK(needles > 100);
    CHECK(outside == 0);
}

TEST_CASE("trap 18: decode drops what is not finite, counts it, and leaves its neighbours as they are")
{
    checkNotFinite<PackedSplat>();
    checkNotFinite<ExactSplat>();
}

TEST_CASE("decode: too few slots are filled, not overrun, and it is said")
{
    checkCapacity<PackedSplat>();
    checkCapacity<ExactSplat>();
}

TEST_CASE("decode: passes together give the splats of one, each once")
{
    for (const bool broken : {false, true}) { // values that are not finite are counted once, too
        checkPasses<PackedSplat>(broken);
        checkPasses<ExactSplat>(broken);
    }
}
