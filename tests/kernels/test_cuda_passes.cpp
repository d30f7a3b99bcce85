// SPDX-License-Identifier: Apache-2.0
// Frames that are drawn in several passes from near to far because memory is short.
#include <gsc/error.h>
#include "tests/kernels/gpu_tools.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>

using namespace gsc;
using namespace gsc::test;

namespace {

#ifdef GSC_CUDA_EMULATION
constexpr uint64_t kBudgetStep = 13; // sixteenths
constexpr uint32_t kSpread = 1;
#else
constexpr uint64_t kBudgetStep = 14;
constexpr uint32_t kSpread = 24; // times as wide and as high, so that many splats make no list that `fast` cuts
#endif

const std::vector<EyeParams> kTwoEyes = {eyeAt(0.4f, -5, 150, 110), eyeAt(0.7f, -5, 97, 120)};

// far enough apart that splats of one eye are none of the other's, or lie far from them
const std::vector<EyeParams> kParallelEyes = {eyeAhead(-1.5f, -5, 150, 110), eyeAhead(1, -5, 97, 120)};

// Likeness of a picture drawn in several passes to that drawn in one. Near: long lists of `fast` are cut at other
// places.
enum class Likeness { Same, Near };

void checkPixels(const Image<float>& got, const Image<float>& want, Likeness likeness)
{
    REQUIRE(got.pixels.size() == want.pixels.size());
    if (likeness == Likeness::Same) {
        CHECK(sameBytes(got.pixels, want.pixels));
        return;
    }
    double sum = 0, worst = 0;
    for (size_t i = 0; i < want.pixels.size(); ++i) {
        const double error = std::abs(double(got.pixels[i]) - double(want.pixels[i]));
        sum += error * error;
        worst = std::max(worst, error);
    }
    CHECK(sum / double(want.pixels.size()) <= 1e-10); // 100 dB
    // rounding may decide whether the splat that crosses the bound, 1e-4, is drawn: its alpha is 0.99 at most, so the light
    // before it is 0.01 at most
    CHECK(worst <= 0.015);
}

void checkFrame(const std::vector<Image<float>>& got, const std::vector<Image<float>>& want, Likeness likeness)
{
    for (size_t e = 0; e < want.size(); ++e) {
        CAPTURE(e);
        checkPixels(got[e], want[e], likeness);
        const EyeCounts &a = got[e].result.eyes[e], &b = want[e].result.eyes[e];
        CHECK(a.anchors_visible == b.anchors_visible);
        CHECK(a.gaussians_alive == b.gaussians_alive);
        CHECK(a.gaussians_visible == b.gaussians_visible);
        CHECK(a.gaussians_dropped == b.gaussians_dropped);
        CHECK(a.pairs == b.pairs);
    }
}

// Draws within less and less memory beside the driver's until that is refused. Returns the most passes of a frame.
uint32_t checkBudgets(const ModelView& model, const FrameOptions& options, const std::vector<Image<float>>& want,
                      const std::vector<EyeParams>& eyes = kTwoEyes, Likeness likeness = Likeness::Same)
{
    uint32_t most = 0;
    const uint64_t context = cudaRenderer().device().context_bytes;
    for (uint64_t part = want[0].result.bytes_resident - context; part > 0; part = part * kBudgetStep / 16) {
        const uint64_t budget = context + part;
        CAPTURE(budget);
        const std::unique_ptr<Renderer> gpu = makeRenderer({"cuda"}, {0, budget});
        bool refused = false;
        try {
            gpu->load(model);
            const auto first = render(*gpu, eyes, options), second = render(*gpu, eyes, options);
            checkFrame(first, want, likeness);
            checkFrame(second, want, likeness);
            CHECK(first[0].result.bytes_resident <= budget);
            if (std::getenv("GSC_TEST_VERBOSE") != nullptr)
                MESSAGE(budget, " bytes: ", first[0].result.passes, " passes, then ", second[0].result.passes);
            most = std::max({most, first[0].result.passes, second[0].result.passes});
        } catch (const Error& error) {
            CHECK(error.code() == ErrorCode::OutOfMemory);
            refused = true;
            if (part < 4096) // not even the model
                CHECK_THROWS_AS((void)gpu->submit({eyes, {}, options}), Error);
        }
        if (!refused)
            continue;
        const auto again = open(model); // nothing is left broken
        checkFrame(render(*again, eyes, options), want, likeness);
        return most;
    }
    FAIL("no budget is too small");
    return 0;
}

} // namespace

TEST_CASE("several passes give the bytes of one, and a budget too small for the model is refused")
{
    const SyntheticModel model({.anchors = 6000 * kManyAnchors, .log_scale = -3.5f});
    FrameOptions merged = mergedEyes(onGrey(Tier::Fast));
    for (const FrameOptions& how : {onGrey(Tier::Fast), onGrey(Tier::Exact), merged}) {
        CAPTURE(uint32_t(how.tier));
        CAPTURE(uint32_t(how.stereo));
        const auto gpu = open(model.view());
        // turned towards each other, and beside each other with bins for both
        for (const bool parallel : {false, true}) {
            CAPTURE(parallel);
            if (parallel && how.tier == Tier::Exact)
                continue; // never shares
            const std::vector<EyeParams>& eyes = parallel ? kParallelEyes : kTwoEyes;
            const auto want = render(*gpu, eyes, how);
            CHECK(want[0].result.passes == 1);
            CHECK(checkBudgets(model.view(), how, want, eyes) >= 3);
        }
    }
}

TEST_CASE("several passes of a compact model give the bytes of one, and both are near those of one that is not")
{
    SyntheticOptions options{.anchors = 6000 * kManyAnchors, .log_scale = -3.5f};
    SyntheticAnchors anchors = randomAnchors(options);
    makeCompact(anchors, options);
    const SyntheticModel plain(syntheticParams(options), anchors, randomMlps(options), {}, 0);
    options.flags |= kModelCompact;
    const SyntheticModel model(syntheticParams(options), anchors, randomMlps(options), {}, 0);
    const FrameOptions how = onGrey(Tier::Fast);
    const auto gpu = open(plain.view());
    const auto near = render(*gpu, kParallelEyes, how);
    gpu->load(model.view());
    const auto want = render(*gpu, kParallelEyes, how);
    for (size_t e = 0; e < 2; ++e) {
        double sum = 0;
        for (size_t i = 0; i < want[e].pixels.size(); ++i)
            sum += std::pow(double(want[e].pixels[i]) - double(near[e].pixels[i]), 2);
        const double mse = sum / double(want[e].pixels.size());
        CHECK(mse > 0); // it is another layout
        CHECK(-10 * std::log10(mse) > 80);
    }
    CHECK(checkBudgets(model.view(), how, want, kParallelEyes) >= 2);
}

TEST_CASE("several passes over what is not finite, and over one depth, which no pass divides")
{
    SyntheticOptions options, small;
    options.anchors = 4000 * kManyAnchors;
    small.anchors = 4000;
    options.log_scale = small.log_scale = -3.5f;
    SyntheticAnchors broken = randomAnchors(options), flat = randomAnchors(small);
    for (uint32_t i = 0; i < options.anchors; i += 7)
        broken.feature[size_t(i) * options.feat_dim + i % options.feat_dim] = NAN;
    for (uint32_t i = 3; i < options.anchors; i += 7)
        broken.offset[size_t(i) * 3 * options.n_offsets + i % 30] = i % 2 == 0 ? NAN : INFINITY;
    for (size_t i = 1; i < small.anchors; ++i)
        std::copy_n(flat.position.begin(), 3, flat.position.begin() + ptrdiff_t(3 * i));
    for (float& offset : flat.offset)
        offset = 0;
    for (const SyntheticAnchors* anchors : {&broken, &flat}) {
        CAPTURE(anchors == &flat);
        const SyntheticOptions& size = anchors == &flat ? small : options;
        const SyntheticModel model(syntheticParams(size), *anchors, randomMlps(size), {}, 0);
        for (const Tier tier : {Tier::Fast, Tier::Exact}) {
            CAPTURE(uint32_t(tier));
            const auto gpu = open(model.view());
            const uint32_t most = checkBudgets(model.view(), onGrey(tier), render(*gpu, kTwoEyes, onGrey(tier)));
            CHECK((most >= 2 || anchors == &flat));
        }
    }
}

TEST_CASE("several passes far from the origin, where coordinates round by more than Gaussians lie from their anchors")
{
    constexpr float kAway = 2000;
    SyntheticOptions options{.anchors = 5000 * kManyAnchors};
    options.log_scale = -6; // offsets of some thousandths
    options.extent = 0.02f; // so close together that many lie where one pass ends
    options.encoding = PositionEncoding::Float;
    SyntheticAnchors anchors = randomAnchors(options);
    for (float& coordinate : anchors.position)
        coordinate += kAway;
    // Gaussians of a pixel or so: larger ones are in the lists of many bins
    for (size_t i = 0; i < anchors.scale.size(); ++i)
        anchors.scale[i] -= i % 6 < 3 ? 0.0f : 3.0f;
    for (size_t i = 0; i < anchors.offset.size(); ++i) // along the view, where the reach has no room to spare
        anchors.offset[i] = i % 3 == 2 ? std::copysign(1.0f, anchors.offset[i]) : 0.0f;
    const SyntheticModel model(syntheticParams(options), anchors, randomMlps(options), {}, 0);
    const auto eyesOf = [](uint32_t times) {
        std::vector<EyeParams> eyes;
        for (const float x : {0.0f, 0.01f}) {
            const float position[3] = {kAway + x, kAway, kAway - 0.3f}, target[3] = {kAway + x, kAway, kAway};
            eyes.push_back(lookAt(position, target, 1.1f, 150 * times, 110 * times));
        }
        return eyes;
    };
    const auto check = [&](Tier tier, uint32_t times, Likeness likeness) {
        CAPTURE(uint32_t(tier));
        CAPTURE(times);
        const std::vector<EyeParams> eyes = eyesOf(times);
        const auto gpu = open(model.view());
        const auto want = render(*gpu, eyes, onGrey(tier));
        CHECK(want[0].result.eyes[0].gaussians_visible > 5000);
        CHECK(checkBudgets(model.view(), onGrey(tier), want, eyes, likeness) >= 2);
    };
    check(Tier::Fast, kSpread, Likeness::Same);
    check(Tier::Exact, 1, Likeness::Same);
    if (kSpread != 1) // lists of some 100,000 splats
        check(Tier::Fast, 1, Likeness::Near);
}
