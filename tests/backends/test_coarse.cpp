// SPDX-License-Identifier: Apache-2.0
// FrameOptions::detail: groups that are far are drawn from coarse copies, near the picture of all Gaussians.
#include "tests/backends/far_scene.h"
#include "tests/kernels/band_tools.h"
#include "tests/support/outcome.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <numeric>

using namespace gsc;
using namespace gsc::test;

namespace {

// Poses of a walk sideways: copies are made, kept, and stale.
std::vector<EyeParams> walkedTo(int i)
{
    return {farEye(0.5f * float(i))};
}

bool sameCounts(const FrameResult& a, const FrameResult& b)
{
    return a.coarse.near == b.coarse.near && a.coarse.kept == b.coarse.kept && a.coarse.stale == b.coarse.stale &&
           a.coarse.made == b.coarse.made;
}

// One group, on the right of where the eye looks, or in the middle.
SyntheticOptions oneGroup()
{
    SyntheticOptions options = farOptions(kGroupSize);
    options.extent = 1.2f; // within one chunk
    return options;
}

// Networks that give every anchor the same: white Gaussians of opacities between two, in no direction of their own.
std::vector<Mlp> plainMlps(const SyntheticOptions& options, float low, float high)
{
    std::vector<Mlp> mlps = randomMlps(options);
    const uint32_t K = options.n_offsets;
    for (Mlp& mlp : mlps) {
        for (LinearLayer& layer : mlp.layers) {
            std::fill(layer.weight.begin(), layer.weight.end(), 0.0f);
            std::fill(layer.bias.begin(), layer.bias.end(), 0.0f);
        }
        std::vector<float>& bias = mlp.layers[1].bias;
        for (size_t o = 0; o < bias.size(); ++o)
            if (mlp.kind == MlpKind::Opacity)
                bias[o] = std::atanh(low + (high - low) * float(o) / float(std::max(K, 2u) - 1));
            else if (mlp.kind == MlpKind::Color)
                bias[o] = 1.5f;
            else // three scales and a rotation
                bias[o] = o % 7 == 3 ? 1.0f : o % 7 < 3 ? 0.0f : 0.3f * float(o % 5) - 0.6f;
    }
    return mlps;
}

// Sum of a picture's light over black.
double lightOf(const ModelView& model, const EyeParams& eye, float detail)
{
    const auto gpu = open(model);
    FrameOptions how = over(0.0f, detailed(detail));
    const auto image = settled(*gpu, {eye}, how);
    CHECK((image[0].result.coarse.kept > groupsOf(image[0].result.coarse) / 3) == (detail > 0));
    return std::accumulate(image[0].pixels.begin(), image[0].pixels.end(), 0.0);
}

} // namespace

TEST_CASE("coarse: fewer Gaussians the larger the detail, of pictures that are near those of all of them")
{
    const FarModel model;
    const auto plain = open(model.view()), coarse = open(model.view());
    const std::vector<EyeParams> eyes = {farEye()};
    const auto all = render(*plain, eyes, detailed(0));
    CHECK(groupsOf(all[0].result.coarse) == 0);
    const struct {
        float detail;
        double least_db, most_share;
    } cases[] = {{1, 44, 0.8}, {2, 37, 0.3}, {4, 34, 0.1}};
    double last_db = 200;
    for (const auto& of : cases) {
        CAPTURE(of.detail);
        coarse->dropCaches();
        const auto first = render(*coarse, eyes, detailed(of.detail)),
                   later = settled(*coarse, eyes, detailed(of.detail));
        const double db = psnr(later[0], all[0]);
        const double share =
            double(later[0].result.eyes[0].gaussians_visible) / double(all[0].result.eyes[0].gaussians_visible);
        const CoarseCounts& counts = later[0].result.coarse;
        tell(of.detail, " pixels: ", psnr(first[0], all[0]), " dB, then ", db, ", share ", share, ", near ",
             counts.near, ", kept ", counts.kept, ", first made ", first[0].result.coarse.made);
        CHECK(first[0].result.coarse.made > 0);
        CHECK(psnr(first[0], all[0]) >= of.least_db);
        CHECK(db >= of.least_db);
        CHECK(db < last_db);
        CHECK(share <= of.most_share);
        last_db = db;
    }
    // nothing of it is left in what follows
    CHECK(sameBytes(render(*coarse, eyes, detailed(0))[0].pixels, all[0].pixels));
}

TEST_CASE("coarse: the same poses give the same bytes, from one cold start as from another")
{
    const FarModel model;
    const auto one = open(model.view()), other = open(model.view());
    std::vector<Image<float>> first;
    uint64_t stale = 0;
    for (const bool again : {false, true}) {
        CAPTURE(again);
        for (int i = 0; i < 5; ++i) {
            CAPTURE(i);
            const auto a = render(*one, walkedTo(i), detailed(2));
            stale += a[0].result.coarse.stale;
            if (again) {
                CHECK(sameBytes(a[0].pixels, first[size_t(i)].pixels));
                CHECK(sameCounts(a[0].result, first[size_t(i)].result));
                continue;
            }
            const auto b = render(*other, walkedTo(i), detailed(2));
            CHECK(sameBytes(a[0].pixels, b[0].pixels));
            CHECK(sameCounts(a[0].result, b[0].result));
            first.push_back(a[0]);
        }
        one->dropCaches();
    }
    CHECK((stale > 0) != kBackend.makes_all); // they are drawn, too
}

TEST_CASE("coarse: before a camera at rest nothing is made any more, and no byte changes")
{
    const FarModel model;
    for (const bool pair : {false, true}) {
        CAPTURE(pair);
        const auto gpu = open(model.view());
        const std::vector<EyeParams> eyes = pair ? farPair() : std::vector<EyeParams>{farEye()};
        const auto rests = settled(*gpu, eyes, detailed(2));
        CHECK(rests[0].result.coarse.kept > 0);
        for (int i = 0; i < 10; ++i) {
            CAPTURE(i);
            const auto now = render(*gpu, eyes, detailed(2));
            CHECK(now[0].result.coarse.made == 0);
            CHECK(now[0].result.coarse.stale == 0);
            for (size_t e = 0; e < eyes.size(); ++e)
                CHECK(sameBytes(now[e].pixels, rests[e].pixels));
        }
    }
}

TEST_CASE("coarse: a group that an eye sees in part is drawn as without detail")
{
    const FarModel model(oneGroup());
    CHECK(model.view().params->group_count == 1);
    const auto plain = open(model.view()), coarse = open(model.view());
    const std::vector<EyeParams> whole = {farEye()}, part = {farEye(0, 8)};
    const auto like = [&](const std::vector<EyeParams>& eyes, bool is_same) {
        const auto all = render(*plain, eyes, detailed(0)), now = render(*coarse, eyes, detailed(2));
        CHECK(all[0].result.eyes[0].gaussians_visible > 0);
        CHECK(sameBytes(now[0].pixels, all[0].pixels) == is_same);
        CHECK((now[0].result.coarse.near == 1) == is_same);
    };
    like(part, true); // before it has a copy
    like(whole, false);
    like(part, true); // not drawn there
    like(whole, false);
    // what one of two eyes sees in part, and the other as a whole, is near
    const std::vector<EyeParams> both = {farEye(0, 8), farEye(0.1f)};
    const auto all = render(*plain, both, detailed(0)), now = render(*coarse, both, detailed(2));
    for (size_t e = 0; e < 2; ++e)
        CHECK(sameBytes(now[e].pixels, all[e].pixels));
}

TEST_CASE("coarse: a turning head finds no hole")
{
    const FarModel model;
    const auto plain = open(model.view()), coarse = open(model.view());
    for (int i = 0; i < 9; ++i) {
        CAPTURE(i);
        const std::vector<EyeParams> eyes = {farEye(0, -6 + 1.5f * float(i))};
        const auto all = render(*plain, eyes, detailed(0)), now = render(*coarse, eyes, detailed(2));
        const CoarseCounts& counts = now[0].result.coarse;
        CHECK(psnr(now[0], all[0]) >= 37);
        double least = 200;
        for (uint32_t x = 0; x < kFarWidth; x += 8)
            least = std::min(least, compare(columnsOf(now[0].pixels, kFarWidth, {x, x + 8}),
                                            columnsOf(all[0].pixels, kFarWidth, {x, x + 8}))
                                        .psnr);
        tell(psnr(now[0], all[0]), " dB, worst columns ", least, ", near ", counts.near, ", made ", counts.made);
        CHECK(least >= 32);
    }
}

TEST_CASE("coarse: counts add up")
{
    const FarModel model;
    const auto gpu = open(model.view());
    const uint64_t groups = model.view().params->group_count;
    uint64_t stale = 0, kept = 0;
    for (int i = 0; i < 10; ++i) {
        CAPTURE(i);
        const FrameResult result = render(*gpu, {farEye(0.25f * float(i))}, detailed(2))[0].result;
        const CoarseCounts& counts = result.coarse;
        const EyeCounts& eye = result.eyes[0];
        CHECK(groupsOf(counts) == groups); // the eye sees all of them
        CHECK(eye.anchors_visible == 4096);
        CHECK(eye.anchors_decoded + eye.anchors_reused == eye.anchors_visible);
        CHECK(eye.anchors_overdue <= eye.anchors_reused);
        CHECK((counts.stale > 0) == (eye.anchors_overdue > 0));
        CHECK((counts.kept + counts.stale > 0) == (eye.anchors_reused > 0));
        CHECK((counts.near + counts.made > 0) == (eye.anchors_decoded > 0));
        CHECK(eye.gaussians_alive >= eye.gaussians_visible);
        stale += counts.stale;
        kept += counts.kept;
    }
    CHECK(kept > 0);
    CHECK((stale > 0) != kBackend.makes_all);
    // eyes that see other groups: each group counts once
    const FrameResult both = render(*gpu, {farEye(0, -5), farEye(0.1f, 5)}, detailed(2))[0].result;
    CHECK(groupsOf(both.coarse) <= groups);
    CHECK(groupsOf(both.coarse) > groups / 2);
}

TEST_CASE("coarse: wires and faint shells keep their light")
{
    const struct {
        const char* what;
        float low, high; // opacity
        float size[3];   // sizes of the Gaussians: twice the standard deviations
        uint32_t anchors, n_offsets;
        double most; // part of the light that may be lost or won
    } cases[] = {{"a shell that is drawn hardly at all", 0.0041f, 0.006f, {0.12f, 0.12f, 0.02f}, 2000, 10, 0.01},
                 {"a faint shell", 0.0041f, 0.02f, {0.12f, 0.12f, 0.02f}, 2000, 10, 0.01},
                 {"wires", 0.7f, 0.7f, {0.25f, 0.004f, 0.004f}, 600, 1, 0.015},
                 {"many wires", 0.7f, 0.7f, {0.25f, 0.004f, 0.004f}, 3000, 1, 0.02},
                 // what lies in one pixel covers it more widely than one Gaussian of all its depth
                 {"bundles of wires", 0.3f, 0.9f, {0.25f, 0.004f, 0.004f}, 150, 10, 0.2}};
    for (const auto& of : cases) {
        CAPTURE(of.what);
        SyntheticOptions options = farOptions(of.anchors);
        options.n_offsets = of.n_offsets;
        SyntheticAnchors anchors = farAnchors(options);
        for (size_t i = 0; i < anchors.count(); ++i)
            for (size_t c = 0; c < 3; ++c)
                anchors.scale[6 * i + 3 + c] = std::log(of.size[c]);
        const SyntheticModel model(syntheticParams(options), anchors, plainMlps(options, of.low, of.high), {}, 0);
        const double all = lightOf(model.view(), farEye(2), 0), some = lightOf(model.view(), farEye(2), 2);
        tell(of.what, ": light ", some / all, " of ", all / (3.0 * kFarWidth * kFarHeight), " a value");
        CHECK(some == doctest::Approx(all).epsilon(of.most));
    }
}

TEST_CASE("coarse: what cannot be is refused")
{
    const FarModel model(oneGroup());
    const auto renderer = open(model.view());
    const auto code = [&](const FrameOptions& options) {
        return outcomeOf([&] { (void)render(*renderer, {farEye()}, options); }).code;
    };
    FrameOptions exact = detailed(2), reusing = detailed(2);
    exact.tier = Tier::Exact;
    CHECK(code(exact) == (kBackend.tiers[0] == Tier::Exact ? ErrorCode::Unsupported : ErrorCode::Ok));
    reusing.reuse.policy = ReusePolicy::Depth;
    CHECK(code(reusing) == ErrorCode::Usage);
    for (const float detail : {9.0f, -1.0f, NAN, INFINITY})
        CHECK(code(detailed(detail)) == ErrorCode::Usage);
    exact.detail = 0; // nothing is broken
    CHECK(render(*renderer, {farEye()}, exact)[0].result.eyes[0].gaussians_visible > 0);
    CHECK(render(*renderer, {farEye()}, detailed(kMostDetail))[0].result.coarse.made == 1);
}
