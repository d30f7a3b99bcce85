// SPDX-License-Identifier: Apache-2.0
// What may be drawn again, and that nothing else changes: policies, budgets, the bound, both eyes.
#include "format/error.h"
#include "format/half.h"
#include "kernels/math/reuse.h"
#include "kernels/schedule/schedule.h"
#include "tests/kernels/render_tools.h"
#include "tests/kernels/synthetic_model.h"

#include <doctest/doctest.h>

#include <cmath>
#include <limits>

using namespace gsc;
using namespace gsc::test;

namespace {

SyntheticOptions modelOptions(LevelRule rule)
{
    SyntheticOptions options;
    options.anchors = 1200;
    options.seed = 7;
    if (rule != LevelRule::None) {
        options.levels = 4;
        options.level_rule = rule;
        options.flags = kModelHasLevels | kModelLodHalfCell;
    }
    return options;
}

// Frame `i` of a walk round the model, eyes `apart` world units from each other.
std::vector<EyeParams> walk(int i, size_t eye_count, float apart = 0.1f)
{
    std::vector<EyeParams> eyes;
    for (size_t e = 0; e < eye_count; ++e) {
        const float position[3] = {0.2f + 0.02f * float(i) + apart * float(e), 0.3f, -5 + 0.01f * float(i)};
        const float target[3] = {0.1f, -0.2f, 0.3f};
        eyes.push_back(lookAt(position, target, 0.9f, 120, 90));
    }
    return eyes;
}

FrameOptions with(ReusePolicy policy, float bound = 0, uint32_t depth = 10)
{
    FrameOptions options;
    options.background[0] = 0.5f;
    options.reuse.policy = policy;
    options.reuse.bound = bound;
    options.reuse.max_depth = depth;
    return options;
}

std::unique_ptr<Backend> open(const ModelView& model, int threads = 2)
{
    std::unique_ptr<Backend> backend = makeCpuBackend(CpuPath::Fast, threads);
    backend->load(model);
    return backend;
}

// That `options` draws over a walk what no reuse does, but for the half precision of the entries.
void checkLikeNone(const ModelView& model, const FrameOptions& options, size_t eye_count)
{
    const auto plain = open(model), reusing = open(model);
    FrameOptions none = options;
    none.reuse = {};
    for (int i = 0; i < 5; ++i) {
        CAPTURE(i);
        const auto expected = render(*plain, walk(i, eye_count), none);
        const auto actual = render(*reusing, walk(i, eye_count), options);
        for (size_t e = 0; e < eye_count; ++e) {
            CHECK(compare(actual[e].pixels, expected[e].pixels).psnr > 70);
            CHECK(double(actual[e].result.eyes[e].gaussians_visible) ==
                  doctest::Approx(double(expected[e].result.eyes[e].gaussians_visible)).epsilon(0.005));
        }
    }
}

} // namespace

TEST_CASE("a bound of 0 and a depth of 0 draw what no reuse draws")
{
    for (const LevelRule rule : {LevelRule::None, LevelRule::Round, LevelRule::Progressive})
        for (const size_t eyes : {1, 2}) {
            CAPTURE(int(rule));
            CAPTURE(eyes);
            const SyntheticModel model(modelOptions(rule));
            checkLikeNone(model.view(), with(ReusePolicy::Error), eyes);
            checkLikeNone(model.view(), with(ReusePolicy::Depth, 0, 0), eyes);
            FrameOptions soft = with(ReusePolicy::Error);
            soft.lod_fade = 0.5f;
            soft.lod_hysteresis = 0.25f;
            checkLikeNone(model.view(), soft, eyes);
        }
}

TEST_CASE("networks with every input, and float positions, draw the same from the cache")
{
    SyntheticOptions options = modelOptions(LevelRule::None);
    options.appearance_dim = 8;
    options.appearance_rows = 3;
    options.flags |= kModelFeatureBank | kModelBankDistance;
    options.inputs = kMlpTakesDistance | kMlpTakesAppearance;
    options.encoding = PositionEncoding::Float;
    options.n_offsets = 5;
    const SyntheticModel model(options);
    FrameOptions frame = with(ReusePolicy::Error);
    frame.appearance = 1;
    checkLikeNone(model.view(), frame, 2);

    // another row is another look: nothing of the first is drawn
    const auto plain = open(model.view()), reusing = open(model.view());
    frame.reuse.bound = 1000;
    (void)render(*reusing, walk(0, 1), frame);
    frame.appearance = 2;
    const auto actual = render(*reusing, walk(0, 1), frame);
    CHECK(actual[0].result.eyes[0].anchors_reused == 0);
    frame.reuse = {};
    CHECK(compare(actual[0].pixels, render(*plain, walk(0, 1), frame)[0].pixels).psnr > 70);
}

TEST_CASE("a camera that stands still decodes once")
{
    const SyntheticModel model(modelOptions(LevelRule::Round));
    const auto backend = open(model.view());
    const auto first = render(*backend, walk(3, 2), with(ReusePolicy::Error));
    for (int i = 0; i < 3; ++i) {
        const auto again = render(*backend, walk(3, 2), with(ReusePolicy::Error));
        for (size_t e = 0; e < 2; ++e) {
            const EyeCounts& counts = again[e].result.eyes[e];
            CHECK(again[e].pixels == first[e].pixels);
            CHECK(counts.anchors_decoded == 0);
            CHECK(counts.anchors_reused == counts.anchors_visible);
        }
    }
    backend->dropCaches();
    CHECK(render(*backend, walk(3, 2), with(ReusePolicy::Error))[0].result.eyes[0].anchors_reused == 0);
}

TEST_CASE("depth decodes every entry again when it is older than the depth allows")
{
    const SyntheticModel model(modelOptions(LevelRule::None));
    const auto backend = open(model.view());
    const FrameOptions options = with(ReusePolicy::Depth, 0, 3);
    for (int i = 0; i < 9; ++i) {
        CAPTURE(i);
        const auto image = render(*backend, walk(0, 1), options);
        const EyeCounts& counts = image[0].result.eyes[0];
        // all entries are of one age, so that they are due at once: the flush of the paper
        CHECK((counts.anchors_decoded > 0) == (i % 4 == 0));
        CHECK((counts.anchors_reused > 0) == (i % 4 != 0));
    }
}

TEST_CASE("the guidance shortens the depth as more of the view is new")
{
    for (const DepthGuidance guidance : {DepthGuidance::Linear, DepthGuidance::Exponential, DepthGuidance::Staged}) {
        CAPTURE(int(guidance));
        CHECK(reuseDepth(guidance, 10, 0) == 10);
        uint32_t before = 10;
        for (float rate = 0; rate <= 1; rate += 0.01f) {
            const uint32_t depth = reuseDepth(guidance, 10, rate);
            CHECK(depth <= before);
            before = depth;
        }
        CHECK(before == 0);
        CHECK(reuseDepth(guidance, 0, 0) == 0);
    }
    CHECK(reuseDepth(DepthGuidance::Linear, 10, 0.5f) == 5);
    CHECK(reuseDepth(DepthGuidance::Exponential, 10, 0.5f) == 1);
    CHECK(reuseDepth(DepthGuidance::Staged, 10, 0.1f) == 5);
}

TEST_CASE("the error policy decodes less the larger its bound and stays close to the truth")
{
    const SyntheticModel model(modelOptions(LevelRule::None));
    uint64_t before = std::numeric_limits<uint64_t>::max();
    for (const float bound : {0.0f, 2.0f, 8.0f, 32.0f}) {
        CAPTURE(bound);
        const auto plain = open(model.view()), reusing = open(model.view());
        uint64_t decoded = 0;
        double worst = 1000;
        for (int i = 0; i < 12; ++i) {
            const auto actual = render(*reusing, walk(i, 1), with(ReusePolicy::Error, bound));
            const auto expected = render(*plain, walk(i, 1), with(ReusePolicy::None));
            decoded += actual[0].result.eyes[0].anchors_decoded;
            worst = std::min(worst, compare(actual[0].pixels, expected[0].pixels).psnr);
        }
        CHECK(decoded < before);
        CHECK(worst > (bound > 8 ? 25 : 40));
        before = decoded;
    }
}

TEST_CASE("a decode budget holds, what is new is decoded all the same, and waiting entries count as overdue")
{
    const SyntheticModel model(modelOptions(LevelRule::None));
    const auto backend = open(model.view());
    FrameOptions options = with(ReusePolicy::Error);
    options.reuse.decode_budget = 100;
    const auto first = render(*backend, walk(0, 1), options);
    CHECK(first[0].result.eyes[0].anchors_decoded >= first[0].result.eyes[0].anchors_visible);
    for (int i = 1; i < 6; ++i) {
        // turned away from nothing: the same anchors stay in view
        std::vector<EyeParams> eye = walk(0, 1);
        eye[0].center[0] += 0.001f * float(i);
        const auto image = render(*backend, eye, options);
        const EyeCounts& counts = image[0].result.eyes[0];
        CHECK(counts.anchors_decoded <= 100);
        CHECK(counts.anchors_decoded > 100 - 16);
        CHECK(counts.anchors_overdue > 0);
        CHECK(counts.anchors_overdue <= counts.anchors_reused);
    }
}

TEST_CASE("a small cache holds its limit and draws the same")
{
    SyntheticOptions many = modelOptions(LevelRule::None);
    many.anchors = 6000;
    const SyntheticModel model(many);
    FrameOptions options = with(ReusePolicy::Error);
    options.reuse.cache_bytes = 1u << 20;
    checkLikeNone(model.view(), options, 2);
    const auto backend = open(model.view());
    uint64_t evicted = 0;
    for (int i = 0; i < 4; ++i) {
        // two views that share little, in turn
        const float center[3] = {0, 0, 0}, target[3] = {0.1f, 0.2f, i % 2 == 0 ? 9.0f : -9.0f};
        const auto image = render(*backend, {lookAt(center, target, 0.8f, 64, 64)}, options);
        evicted += image[0].result.cache_evictions;
        // the tables that find an entry are not part of the limit, they are a few bytes per strip
        CHECK(image[0].result.cache_bytes < options.reuse.cache_bytes + (1u << 18));
    }
    CHECK(evicted > 0);
    options.reuse.cache_bytes = 1; // room for nothing
    checkLikeNone(model.view(), options, 2);
}

TEST_CASE("a limit that falls is kept at once, and dropping the caches gives their memory back")
{
    SyntheticOptions many = modelOptions(LevelRule::None);
    many.anchors = 6000;
    const SyntheticModel model(many);
    const auto backend = open(model.view());
    FrameOptions options = with(ReusePolicy::Error, 4);
    const uint64_t much = render(*backend, walk(0, 1), options)[0].result.cache_bytes;
    options.reuse.cache_bytes = 1u << 20;
    const auto less = render(*backend, walk(1, 1), options);
    CHECK(less[0].result.cache_bytes < much);
    CHECK(less[0].result.cache_bytes < options.reuse.cache_bytes + (1u << 18));
    CHECK(less[0].result.cache_evictions > 0);
    options.reuse.cache_bytes = 64u << 20; // and one that rises is used
    CHECK(render(*backend, walk(1, 1), options)[0].result.cache_bytes == much);
    backend->dropCaches();
    options.reuse.cache_bytes = 1;
    const auto none = render(*backend, walk(2, 1), options);
    CHECK(none[0].result.cache_bytes < 1u << 18);
    CHECK(none[0].result.eyes[0].anchors_reused == 0);
}

TEST_CASE("what is seen for the first time is decoded well whatever the budget")
{
    SyntheticOptions many = modelOptions(LevelRule::None);
    many.anchors = 4000;
    const SyntheticModel model(many);
    const auto plain = open(model.view()), reusing = open(model.view());
    FrameOptions options = with(ReusePolicy::Error, 1);
    options.reuse.decode_budget = 16;
    for (int i = 0; i < 10; ++i)
        (void)render(*reusing, walk(i, 1), options);
    // looks elsewhere from the next place of the walk
    std::vector<EyeParams> eyes = walk(10, 1);
    const float target[3] = {9, 2, -4};
    eyes = {lookAt(eyes[0].center, target, 0.9f, 120, 90)};
    const auto actual = render(*reusing, eyes, options);
    CHECK(actual[0].result.eyes[0].anchors_decoded > 100);
    CHECK(compare(actual[0].pixels, render(*plain, eyes, with(ReusePolicy::None))[0].pixels).psnr > 50);
}

TEST_CASE("an eye that draws the other's decode shows it, also where no entry holds it")
{
    const SyntheticModel model(modelOptions(LevelRule::None));
    for (const uint64_t limit : {uint64_t(0), uint64_t(1)}) {
        CAPTURE(limit);
        const auto plain = open(model.view()), reusing = open(model.view());
        FrameOptions options = with(ReusePolicy::Error, 4);
        options.reuse.cache_bytes = limit;
        for (int i = 0; i < 4; ++i) {
            const auto actual = render(*reusing, walk(i, 2, 0.001f), options);
            const auto expected = render(*plain, walk(i, 2, 0.001f), with(ReusePolicy::None));
            for (size_t e = 0; e < 2; ++e)
                CHECK(compare(actual[e].pixels, expected[e].pixels).psnr > 45);
            CHECK(actual[1].result.eyes[1].anchors_reused > 0);
        }
    }
}

// The right eye's own entry is from long ago, since it has drawn the left one's ever since.
TEST_CASE("an eye that would share what the budget does not let the other decode draws the better of both entries")
{
    const SyntheticModel model(modelOptions(LevelRule::None));
    const auto plain = open(model.view()), reusing = open(model.view());
    FrameOptions options = with(ReusePolicy::Error, 4);
    (void)render(*reusing, {walk(-160, 1)[0], walk(-110, 1)[0]}, options); // so far apart that both decode
    for (int i = 0; i < 8; ++i)
        (void)render(*reusing, walk(i % 2, 2, 0.001f), options);
    options.reuse.bound = 0.3f;
    options.reuse.decode_budget = 1;
    const auto actual = render(*reusing, walk(2, 2, 0.001f), options);
    const auto expected = render(*plain, walk(2, 2, 0.001f), with(ReusePolicy::None));
    for (size_t e = 0; e < 2; ++e) {
        CAPTURE(e);
        CHECK(actual[e].result.eyes[e].anchors_overdue > 100);
        const Difference d = compare(actual[e].pixels, expected[e].pixels);
        CHECK(d.psnr > 60);       // 66 measured, 38 for the right eye if it has only its own
        CHECK(d.worst * 255 < 6); // 3.7, and 54
    }
}

TEST_CASE("black and background are told apart as without reuse")
{
    size_t black = 0, grey = 0;
    for (uint32_t seed = 1; seed <= 60; ++seed) {
        SyntheticOptions options;
        options.anchors = 3;
        options.n_offsets = 1;
        options.seed = seed;
        const SyntheticModel model(options);
        const auto plain = open(model.view(), 1), reusing = open(model.view(), 1);
        FrameOptions none = with(ReusePolicy::None);
        const auto expected = render(*plain, walk(0, 1), none);
        const auto actual = render(*reusing, walk(0, 1), with(ReusePolicy::Error));
        CAPTURE(seed);
        CHECK(compare(actual[0].pixels, expected[0].pixels).psnr > 60);
        black += expected[0].pixels[0] == 0;
        grey += expected[0].pixels[0] == 0.5f;
    }
    CHECK(black > 0);
    CHECK(grey > 0);
}

TEST_CASE("eyes come and go, policies change, and both eyes stay within what the options say")
{
    const SyntheticModel model(modelOptions(LevelRule::None));
    const auto plain = open(model.view()), reusing = open(model.view());
    for (int i = 0; i < 40; ++i) {
        CAPTURE(i);
        const size_t eyes = size_t(i / 5) % 2 + 1;
        const ReusePolicy policy = i % 7 == 3   ? ReusePolicy::None
                                   : i % 11 > 7 ? ReusePolicy::Depth
                                                : ReusePolicy::Error;
        FrameOptions options = with(policy, 2, 1);
        options.reuse.decode_budget = i % 3 == 0 ? 400 : 0;
        const auto actual = render(*reusing, walk(i, eyes), options);
        const auto expected = render(*plain, walk(i, eyes), with(ReusePolicy::None));
        for (size_t e = 0; e < eyes; ++e)
            CHECK(compare(actual[e].pixels, expected[e].pixels).psnr > 40);
    }
}

TEST_CASE("images do not depend on the number of threads, whatever is kept")
{
    const SyntheticModel model(modelOptions(LevelRule::Round));
    FrameOptions options = with(ReusePolicy::Error, 1);
    options.reuse.decode_budget = 300;
    options.reuse.cache_bytes = 4u << 20;
    const auto one = open(model.view(), 1), many = open(model.view(), 5);
    for (int i = 0; i < 8; ++i) {
        const auto a = render(*one, walk(2 * i, 2), options), b = render(*many, walk(2 * i, 2), options);
        CHECK(a[0].pixels == b[0].pixels);
        CHECK(a[1].pixels == b[1].pixels);
        CHECK(a[1].result.eyes[1].anchors_decoded == b[1].result.eyes[1].anchors_decoded);
    }
}

TEST_CASE("an eye draws what the other had decoded if the bound allows it")
{
    const SyntheticModel model(modelOptions(LevelRule::None));
    const auto backend = open(model.view());
    const auto near = render(*backend, walk(0, 2, 0.0001f), with(ReusePolicy::Error, 4));
    const EyeCounts &left = near[0].result.eyes[0], &right = near[1].result.eyes[1];
    CHECK(left.anchors_reused == 0);
    CHECK(right.anchors_reused + 64 > right.anchors_visible); // all but what the left eye does not see
    backend->dropCaches();
    const auto apart = render(*backend, walk(0, 2, 2.0f), with(ReusePolicy::Error, 0.01f));
    CHECK(apart[1].result.eyes[1].anchors_reused == 0);
}

TEST_CASE("on a straight way entries are drawn between two keys: fewer decodes and less error than the paper's depth")
{
    const SyntheticModel model(modelOptions(LevelRule::None));
    const auto measure = [&](const FrameOptions& options, uint64_t& decoded) {
        const auto plain = open(model.view()), reusing = open(model.view());
        double worst = 1000;
        decoded = 0;
        for (int i = 0; i < 24; ++i) {
            const auto actual = render(*reusing, walk(i, 1), options);
            const auto expected = render(*plain, walk(i, 1), with(ReusePolicy::None));
            decoded += i > 0 ? actual[0].result.eyes[0].anchors_decoded : 0;
            worst = std::min(worst, compare(actual[0].pixels, expected[0].pixels).psnr);
        }
        return worst;
    };
    uint64_t by_depth = 0, by_error = 0;
    const double depth = measure(with(ReusePolicy::Depth, 0, 5), by_depth);
    const double error = measure(with(ReusePolicy::Error, 1), by_error);
    CHECK(by_error < by_depth);
    CHECK(error > depth + 10);
}

TEST_CASE("a camera that turns back is drawn within the bound too")
{
    const SyntheticModel model(modelOptions(LevelRule::None));
    const auto plain = open(model.view()), reusing = open(model.view());
    for (int i = 0; i < 24; ++i) {
        CAPTURE(i);
        const int at = i % 8 < 4 ? i % 8 : 8 - i % 8; // to and fro, with a jump now and then
        const std::vector<EyeParams> eye = walk(at + (i > 16 ? 40 : 0), 1);
        const auto actual = render(*reusing, eye, with(ReusePolicy::Error, 4));
        const auto expected = render(*plain, eye, with(ReusePolicy::None));
        CHECK(compare(actual[0].pixels, expected[0].pixels).psnr > 45);
    }
}

// What passes beside the camera changes fast and is not seen: it has nothing decoded again. Once the camera turns to it,
// it is held to the bound like all else.
TEST_CASE("anchors that are not seen make nothing due, and are drawn within the bound when they come into view")
{
    SyntheticOptions of = modelOptions(LevelRule::None);
    of.anchors = 3000;
    const SyntheticModel model(of);
    const auto plain = open(model.view()), reusing = open(model.view());
    uint64_t decoded = 0, visible = 0;
    for (int i = 0; i < 40; ++i) {
        CAPTURE(i);
        const float position[3] = {0.1f, 0.2f, -2 + 0.02f * float(i)};
        const float turn = i > 32 ? 1.5f : 0.0f;
        const float target[3] = {0.1f + std::sin(turn), 0.2f, position[2] + std::cos(turn)};
        const std::vector<EyeParams> eye = {lookAt(position, target, 0.9f, 120, 90)};
        const auto actual = render(*reusing, eye, with(ReusePolicy::Error, 4));
        const auto expected = render(*plain, eye, with(ReusePolicy::None));
        const double psnr = compare(actual[0].pixels, expected[0].pixels).psnr;
        CHECK(psnr > (i > 32 ? 54 : 45));
        const EyeCounts& counts = actual[0].result.eyes[0];
        if (i >= 8 && i <= 32) {
            decoded += counts.anchors_decoded;
            visible += counts.anchors_visible;
        }
    }
    CHECK(double(decoded) < 0.07 * double(visible));
}

// A pixel of a picture of 8 x 6 is a fiftieth of it, so that there every Gaussian is broad.
TEST_CASE("Gaussians that take much of the picture are decoded again sooner, and show less error for it")
{
    const SyntheticModel model(modelOptions(LevelRule::None));
    const auto measure = [&](uint32_t width, uint32_t height) {
        const auto plain = open(model.view()), reusing = open(model.view());
        uint64_t decoded = 0;
        double worst = 1000;
        for (int i = 0; i < 24; ++i) {
            const float position[3] = {0.2f + 0.02f * float(i), 0.3f, -5};
            const float target[3] = {0.1f, -0.2f, 0.3f};
            const std::vector<EyeParams> eye = {lookAt(position, target, 0.9f, width, height)};
            const auto actual = render(*reusing, eye, with(ReusePolicy::Error, 4));
            decoded += i > 0 ? actual[0].result.eyes[0].anchors_decoded : 0;
            const auto expected = render(*plain, eye, with(ReusePolicy::None));
            worst = std::min(worst, compare(actual[0].pixels, expected[0].pixels).psnr);
        }
        return std::pair<uint64_t, double>(decoded, worst);
    };
    const auto wide = measure(120, 90), tiny = measure(8, 6);
    CHECK(wide.first > 0);
    CHECK(double(tiny.first) > 1.2 * double(wide.first));
    CHECK(tiny.second > wide.second + 3);
}

TEST_CASE("what is left of the bound keeps the mean square error of the broadest Gaussian at that of one of kBroad")
{
    CHECK(broadShare(0) == 1);
    CHECK(broadShare(kBroad) == 1);
    for (const float cover : {0.03f, 0.2f, 1.0f})
        CHECK(broadShare(cover) * broadShare(cover) * cover == doctest::Approx(kBroad));
}

TEST_CASE("a needle counts by how much thinner it is than a sensitivity takes it for")
{
    const float round[3] = {0.01f, 0, 0.01f};
    CHECK(thinness(round, 0.1f) == 1);
    const float tenth[3] = {1, 0, 0.01f}, thirtieth[3] = {1, 0, 1 / 900.0f};
    CHECK(thinness(tenth, 0.1f) == doctest::Approx(1).epsilon(0.03));
    CHECK(thinness(thirtieth, 0.1f) == doctest::Approx(9).epsilon(0.01));
    const float mean = 0.5f + 1 / 1800.0f, turned[3] = {mean, 1 - mean, mean}; // the same at 45 degrees
    CHECK(thinness(turned, 0.1f) == doctest::Approx(9).epsilon(0.01));
    const float flat[3] = {1, 1, 1}, wrong[3] = {1, 2, 1}, unknown[3] = {NAN, 0, 1};
    for (const float* conic : {flat, wrong, unknown})
        CHECK(thinness(conic, 0.1f) == kThinnest);
}

TEST_CASE("a way that bends is decoded little more often than a straight one")
{
    const SyntheticModel model(modelOptions(LevelRule::None));
    const auto count = [&](float bend) {
        const auto backend = open(model.view());
        uint64_t decoded = 0;
        for (int i = 0; i < 48; ++i) {
            const float angle = bend * float(i); // round the model, or along the tangent
            const float position[3] = {bend > 0 ? 5 * std::sin(angle) : 0.02f * float(i), 0.3f,
                                       bend > 0 ? -5 * std::cos(angle) : -5.0f};
            const float target[3] = {0.1f, -0.2f, 0.3f};
            const std::vector<EyeParams> eye = {lookAt(position, target, 0.9f, 120, 90)};
            const auto image = render(*backend, eye, with(ReusePolicy::Error, 1));
            decoded += i > 4 ? image[0].result.eyes[0].anchors_decoded : 0;
        }
        return decoded;
    };
    const uint64_t straight = count(0), round = count(0.004f);
    CHECK(straight > 0);
    CHECK(double(round) < 1.5 * double(straight));
}

TEST_CASE("predicted changes of a strip are the scalar rule's, the largest of the lanes asked for")
{
    const SyntheticModel synthetic(modelOptions(LevelRule::None));
    const ModelView& model = synthetic.view();
    std::vector<uint16_t> halves(2 * 1200);
    for (size_t i = 0; i < halves.size(); ++i)
        halves[i] = floatToHalfUp(0.001f * float(i % 97));
    const float c0[3] = {0.3f, -0.1f, -5}, c1[3] = {0.4f, 0.1f, -4.8f};
    for (uint64_t g = 0; g < model.params->group_count; ++g) {
        GroupAnchors anchors;
        loadGroupAnchors(model, halves.data(), model.groups[g], anchors);
        for (uint32_t strip = 0; strip * kStripAnchors < anchors.count; ++strip)
            for (const uint32_t lanes : {0xffffu, 0x0001u, 0x8000u, 0x0f30u}) {
                double expected = 0;
                for (uint32_t i = 0; i < kStripAnchors; ++i) {
                    const uint32_t at = strip * kStripAnchors + i;
                    if (lanes >> i & 1)
                        expected = std::max(
                            expected, double(predictedChange<float>({anchors.x[at], anchors.y[at], anchors.z[at]}, c0,
                                                                    c1, anchors.direction[at], anchors.distance[at])));
                }
                CHECK(double(stripError(anchors, strip, lanes, c0, c1)) == doctest::Approx(expected).epsilon(1e-4));
            }
        const float on[3] = {anchors.x[5], anchors.y[5], anchors.z[5]};
        CHECK(std::isinf(stripError(anchors, 0, 1u << 5, on, c1)));
        CHECK(std::isinf(stripError(anchors, 0, 1u << 5, c0, on)));
        CHECK(stripError(anchors, 0, 0xffff, c0, c0) == 0);
    }
    for (const float v : {0.0f, 1e-7f, 6.1e-5f, 0.1f, 1.0f, 1.0003f, 2047.5f, 65503.0f}) {
        CHECK(halfValue(floatToHalfUp(v)) >= v);
        CHECK(halfValue(floatToHalfUp(v)) <= v * 1.001f + 6e-8f);
    }
    CHECK(halfValue(floatToHalfUp(INFINITY)) == 65504);
    CHECK(halfValue(floatToHalfUp(NAN)) == 65504);
}

TEST_CASE("the bound of a change is never below it, and little above it for small steps")
{
    const SyntheticModel synthetic(modelOptions(LevelRule::None));
    const ModelView& model = synthetic.view();
    std::vector<uint16_t> halves(2 * 1200);
    for (size_t i = 0; i < halves.size(); ++i)
        halves[i] = floatToHalfUp(0.001f * float(i % 97));
    uint32_t state = 1;
    const auto random = [&state] {
        state = state * 1664525u + 1013904223u;
        return float(state >> 8) * 0x1p-23f - 1;
    };
    uint64_t told = 0, near = 0;
    for (uint64_t g = 0; g < model.params->group_count; ++g) {
        GroupAnchors anchors;
        loadGroupAnchors(model, halves.data(), model.groups[g], anchors);
        for (int i = 0; i < 400; ++i) {
            const uint32_t strip = uint32_t(i) % ((anchors.count + kStripAnchors - 1) / kStripAnchors);
            const float size = std::exp2(-10 * std::abs(random()));
            float reference[3], c0[3], c1[3];
            for (int axis = 0; axis < 3; ++axis) {
                reference[axis] = 3 * random();
                c0[axis] = reference[axis] + size * random();
                c1[axis] = i % 9 == 0 ? c0[axis] : reference[axis] + size * random();
            }
            const StripReach reach = stripReach(anchors, strip, reference);
            const float bound = changeBound(reach, reference, c0, c1);
            const float change = stripError(anchors, strip, 0xffff, c0, c1);
            CHECK(bound >= change);
            told += bound < 1e30f;
            near += bound < 4 * change;
        }
    }
    CHECK(told > 400 * model.params->group_count / 2);
    CHECK(near > 400 * model.params->group_count / 10);
    const float away[3] = {100, 0, 0}, here[3] = {0, 0, 0};
    CHECK(std::isinf(changeBound({1, 2, 1}, here, here, away)));
    CHECK(std::isinf(changeBound({}, here, here, here)));
}

TEST_CASE("what cannot be kept is refused")
{
    const SyntheticModel model(modelOptions(LevelRule::None));
    const auto reference = makeCpuBackend(CpuPath::Reference, 1);
    reference->load(model.view());
    const std::vector<EyeParams> eyes = walk(0, 1);
    FrameResult result;
    CHECK_THROWS_AS(reference->render(eyes.data(), 1, with(ReusePolicy::Error), nullptr, result), Error);
    const auto fast = open(model.view());
    for (const float bound : {-1.0f, 2e6f, std::numeric_limits<float>::quiet_NaN()})
        CHECK_THROWS_AS(fast->render(eyes.data(), 1, with(ReusePolicy::Error, bound), nullptr, result), Error);
}
