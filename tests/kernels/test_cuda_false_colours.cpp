// SPDX-License-Identifier: Apache-2.0
// False colours on a GPU: those of the CPU.
#include "tests/backends/false_colour_tools.h"

#include <doctest/doctest.h>

using namespace gsc;
using namespace gsc::test;

namespace {

FrameOptions viewed(FrameOptions options, FrameView view)
{
    options.view = view;
    return options;
}

} // namespace

TEST_CASE("false colours: levels and ages are the CPU's, in both tiers, of eyes with and without bins of their own")
{
    for (const LevelRule rule : {LevelRule::None, LevelRule::Round}) {
        const SyntheticModel model(modelOptions(rule));
        const auto gpu = open(model.view()), cpu = open(model.view(), "cpu");
        for (const Tier tier : {Tier::Exact, Tier::Fast})
            for (const StereoMode stereo : {StereoMode::Exact, StereoMode::Merged})
                for (const FrameView view : {FrameView::Picture, FrameView::Level, FrameView::Age})
                    for (const bool shared : {false, true}) {
                        CAPTURE(int(tier));
                        CAPTURE(int(stereo));
                        CAPTURE(int(view));
                        CAPTURE(shared);
                        FrameOptions options = viewed(onGrey(tier), view);
                        options.stereo = stereo;
                        const auto eyes = shared ? viewsAhead() : viewEyes(0, 2);
                        const auto a = render(*gpu, eyes, options), b = render(*cpu, eyes, options);
                        for (size_t e = 0; e < 2; ++e)
                            CHECK(compare(a[e].pixels, b[e].pixels).psnr > (tier == Tier::Exact ? 90 : 60));
                    }
    }
}

TEST_CASE("false colours: costs are of the CPU's order, and none is what nothing reaches")
{
    const SyntheticModel model(modelOptions());
    const FrameOptions options = viewed(onGrey(Tier::Exact), FrameView::Cost);
    const auto gpu = countsOf(render(*open(model.view()), viewEyes(0, 1), options)[0].pixels);
    const auto cpu = countsOf(render(*open(model.view(), "cpu"), viewEyes(0, 1), options)[0].pixels);
    double of_gpu = 0, of_cpu = 0;
    for (size_t i = 0; i < gpu.size(); ++i) { // sub-tiles are of another size than the CPU's blocks
        of_gpu += gpu[i];
        of_cpu += cpu[i];
    }
    CHECK(of_gpu < 2 * of_cpu);
    CHECK(of_cpu < 2 * of_gpu);
}

namespace {

// Small Gaussians, some of which are joined from afar.
SyntheticOptions farModel()
{
    SyntheticOptions options = modelOptions();
    options.log_scale = -4.5f;
    options.extent = 1;
    return options;
}

// Two eyes that are so far apart, about the same place.
std::vector<EyeParams> fromAfar(float apart)
{
    std::vector<EyeParams> eyes;
    for (const float side : {-0.5f, 0.5f}) {
        const float position[3] = {side * apart, 0.2f, -12}, target[3] = {side * apart, 0, 0};
        eyes.push_back(lookAt(position, target, 0.45f, 128, 96));
    }
    return eyes;
}

// Over black: mixtures of two colours, in which both are found, or of one.
void checkColours(const std::vector<Image<float>>& images, const FalseColour& first, const FalseColour& second,
                  float slack)
{
    const float a[3] = {first.r, first.g, first.b}, b[3] = {second.r, second.g, second.b};
    const auto dot = [](const float* x, const float* y) { return x[0] * y[0] + x[1] * y[1] + x[2] * y[2]; };
    const float det = dot(a, a) * dot(b, b) - dot(a, b) * dot(a, b);
    if (det < 1e-6f)
        return checkOneColour(images, first, slack);
    for (const Image<float>& image : images) {
        size_t others = 0, of_first = 0, of_second = 0;
        for (size_t p = 0; p < image.pixels.size(); p += 3) {
            const float* const pixel = &image.pixels[p];
            const float x = (dot(pixel, a) * dot(b, b) - dot(pixel, b) * dot(a, b)) / det,
                        y = (dot(pixel, b) * dot(a, a) - dot(pixel, a) * dot(a, b)) / det;
            of_first += x > 0.5f;
            of_second += y > 0.5f;
            others += x < -slack || y < -slack;
            for (size_t c = 0; c < 3; ++c)
                others += std::abs(x * a[c] + y * b[c] - pixel[c]) > slack;
        }
        CHECK(of_first > 100);
        CHECK(of_second > 100);
        CHECK(others == 0);
    }
}

} // namespace

TEST_CASE("false colours: groups are near, kept, stale or made, as they are counted")
{
    const SyntheticModel model(farModel());
    const auto gpu = open(model.view()), plain = open(model.view());
    FrameOptions options = over(0.0f, viewed(onGrey(Tier::Fast), FrameView::Detail));
    options.detail = 8;
    FrameOptions picture = viewed(options, FrameView::Picture);
    // A frame makes some of the copies that it wants; the second and third make the rest, and are not looked at. One is
    // stale where none could be better: the eyes are too far apart.
    using enum GroupSource;
    const std::vector<std::pair<float, std::vector<GroupSource>>> frames = {
        {0.1f, {Near, Made}}, {0.1f, {}}, {0.1f, {}}, {0.1f, {Kept}}, {2.2f, {Stale}}, {0.1f, {Kept}}, {4.0f, {Near}}};
    for (size_t i = 0; i < frames.size(); ++i) {
        CAPTURE(i);
        const auto& [apart, sources] = frames[i];
        const auto images = render(*gpu, fromAfar(apart), options), drawn = render(*plain, fromAfar(apart), picture);
        const CoarseCounts &counts = images[0].result.coarse, &same = drawn[0].result.coarse;
        CHECK(counts.made == same.made); // a view changes nothing
        CHECK(counts.kept == same.kept);
        if (sources.empty())
            continue;
        const uint64_t of[] = {counts.near, counts.kept, counts.stale, counts.made};
        for (uint32_t s = 0; s < 4; ++s) {
            CAPTURE(s);
            CHECK((of[s] > 0) == (std::ranges::count(sources, GroupSource(s)) > 0));
        }
        checkColours(images, detailColour(sources.front()), detailColour(sources.back()), 2e-3f);
    }
    options.view = FrameView::Level;
    checkOneColour(render(*gpu, fromAfar(0.1f), options), levelColour(model.view().levels[0].level), 2e-3f);
}
