// SPDX-License-Identifier: Apache-2.0
// Decode in `fast` with blocks of few warps, which go through many steps, and rings as full as they can be.
#include "tests/kernels/gpu_decode.h"

#include <doctest/doctest.h>

#include <cmath>

using namespace gsc;
using namespace gsc::test;

namespace {

constexpr size_t kTwoWarps = 42 * 1024, kEightWarps = 99 * 1024; // bytes of shared memory

constexpr uint32_t kAnchors = 600;
// kFast but for covariances and depths, of which so many Gaussians have worse ones: twice the worst (2.4e-2, 1.5e-6)
constexpr DecodeTolerance kOfMany{kFast.pixel, 4.7e-2, kFast.color, kFast.opacity, 3e-6};

// opaque: every Gaussian lives.
SyntheticModel model(uint32_t n_offsets, bool opaque)
{
    SyntheticOptions options{.anchors = kAnchors, .n_offsets = n_offsets, .log_scale = -2.6f};
    std::vector<Mlp> mlps = randomMlps(options);
    if (opaque)
        for (float& bias : mlps[0].layers[1].bias)
            bias += 12;
    return SyntheticModel(syntheticParams(options), randomAnchors(options), mlps, {}, 0);
}

std::vector<EyeParams> eyesOf(uint32_t count)
{
    std::vector<EyeParams> eyes = {eyeAt(0.4f, -5, 150, 110), eyeAt(1.9f, -4, 97, 143)};
    eyes.resize(count);
    return eyes;
}

void checkSame(const Decoded<PackedSplat>& a, const Decoded<PackedSplat>& b, uint32_t eye_count)
{
    for (uint32_t e = 0; e < eye_count; ++e) {
        CHECK(a.eyes[e].size() == b.eyes[e].size());
        uint32_t differ = 0;
        for (const auto& [order, splat] : a.eyes[e]) {
            const auto at = b.eyes[e].find(order);
            differ += at == b.eyes[e].end() || !sameSplat(at->second, splat);
        }
        CHECK(differ == 0);
        CHECK(a.counters.gaussians[e] == b.counters.gaussians[e]);
        CHECK(a.counters.any_positive[e] == b.counters.any_positive[e]);
    }
}

} // namespace

TEST_CASE("decode fast: as many Gaussians as anchors can have, in blocks of any size")
{
    for (const uint32_t offsets : {1u, 9u, 10u, 11u, 12u})
        for (const uint32_t eye_count : {1u, 2u})
            for (const bool opaque : {true, false}) {
                CAPTURE(offsets);
                CAPTURE(eye_count);
                CAPTURE(opaque);
                const SyntheticModel synthetic = model(offsets, opaque);
                StageModel stage(synthetic.view());
                DecodeJob job = decodeJob(synthetic.view(), stage, eyesOf(eye_count), kAnchors);
                job.shared_bytes = kTwoWarps;
                const Decoded<PackedSplat> few = decodeOnDevice<PackedSplat>(job);
                CHECK(few.counters.overflow == 0);
                checkSplats(job, few, kOfMany);
                if (opaque)
                    for (uint32_t e = 0; e < eye_count; ++e)
                        CHECK(few.counters.gaussians[e] == decodeOnHost(job, e).gaussians.size());
                for (const size_t bytes : {kEightWarps, size_t(0)}) {
                    job.shared_bytes = bytes;
                    checkSame(decodeOnDevice<PackedSplat>(job), few, eye_count);
                }
            }
}

TEST_CASE("decode fast: fractions of levels, in blocks of any size")
{
    const SyntheticModel synthetic = model(10, false);
    StageModel stage(synthetic.view());
    for (const uint32_t eye_count : {1u, 2u}) {
        CAPTURE(eye_count);
        DecodeJob job = decodeJob(synthetic.view(), stage, eyesOf(eye_count), kAnchors);
        for (size_t i = 0; i < 2 * job.visible.size(); ++i)
            job.fraction.push_back(float(i % 11) / 10);
        job.shared_bytes = kTwoWarps;
        const Decoded<PackedSplat> few = decodeOnDevice<PackedSplat>(job);
        checkSplats(job, few, kOfMany);
        CHECK(few.eyes[0].size() > 500);
        job.shared_bytes = 0;
        checkSame(decodeOnDevice<PackedSplat>(job), few, eye_count);
    }
}

TEST_CASE("decode fast: a bias that is not a number reaches what it adds to")
{
    SyntheticOptions options{.anchors = 40};
    std::vector<Mlp> mlps = randomMlps(options);
    mlps[0].layers[0].bias[3] = NAN; // bias of the opacities
    const SyntheticModel synthetic(syntheticParams(options), randomAnchors(options), mlps, {}, 0);
    StageModel stage(synthetic.view());
    const Decoded<PackedSplat> decoded = decodeOnDevice<PackedSplat>(decodeJob(synthetic.view(), stage, eyesOf(2), 40));
    CHECK(decoded.eyes[0].empty());
    CHECK(decoded.eyes[1].empty());
}
