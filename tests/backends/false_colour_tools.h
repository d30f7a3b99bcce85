// SPDX-License-Identifier: Apache-2.0
// Checks of a view in false colours, for every renderer.
#pragma once

#include "kernels/present/false_colour.h"
#include "tests/backends/reuse_scene.h"

#include <array>
#include <cstring>
#include <map>
#include <set>

namespace gsc::test {

// As walk(), of images that end where blocks and bins of pixels do: what is counted is then what is seen.
inline std::vector<EyeParams> viewEyes(int i, size_t eye_count)
{
    std::vector<EyeParams> eyes = walk(i, eye_count);
    for (EyeParams& eye : eyes) {
        const float position[3] = {eye.center[0], eye.center[1], eye.center[2]}, target[3] = {0.1f, -0.2f, 0.3f};
        eye = lookAt(position, target, 0.9f, 128, 96);
    }
    return eyes;
}

// Two that look the same way, and so share their bins.
inline std::vector<EyeParams> viewsAhead()
{
    return {eyeAhead(0.2f, -5, 128, 96), eyeAhead(0.3f, -5, 128, 96)};
}

inline std::map<std::array<float, 3>, uint32_t> countsByColour()
{
    std::map<std::array<float, 3>, uint32_t> counts;
    for (uint32_t n = 0; n < 4096; ++n) {
        const FalseColour c = costColour(n);
        counts.emplace(std::array<float, 3>{c.r, c.g, c.b}, n);
    }
    return counts;
}

// Evaluations of the pixels of a picture of FrameView::Cost; none may be white.
inline std::vector<uint32_t> countsOf(const std::vector<float>& pixels)
{
    const auto counts = countsByColour();
    std::vector<uint32_t> found;
    size_t others = 0;
    for (size_t i = 0; i < pixels.size(); i += 3) {
        const auto at = counts.find({pixels[i], pixels[i + 1], pixels[i + 2]});
        others += at == counts.end() || at->second == 4095;
        found.push_back(at == counts.end() ? 0 : at->second);
    }
    CHECK(others == 0);
    return found;
}

// The counts of the pixels are the frame's, which are those of the picture.
inline void checkCost(Renderer& renderer, const std::vector<EyeParams>& eyes, FrameOptions options)
{
    const auto cost = render(renderer, eyes, options);
    std::vector<std::vector<float>> pictures[2];
    const auto depths = renderDepths(renderer, eyes, options, pictures[0]);
    options.view = FrameView::Picture;
    const auto picture = render(renderer, eyes, options);
    const auto same_depths = renderDepths(renderer, eyes, options, pictures[1]);
    for (size_t e = 0; e < eyes.size(); ++e) {
        uint64_t sum = 0;
        std::set<uint32_t> kinds;
        for (const uint32_t n : countsOf(cost[e].pixels)) {
            sum += n;
            kinds.insert(n);
        }
        CHECK(sum == cost[e].result.eyes[e].blend_evaluations);
        CHECK(sum == picture[e].result.eyes[e].blend_evaluations);
        CHECK(kinds.size() > 10);
        CHECK(depths[e] == same_depths[e]);
        CHECK(pictures[0][e] == cost[e].pixels);
    }
}

// One renderer shows pictures alone, the other views between them; the pictures are the same.
inline void checkSwitching(Renderer& plain, Renderer& switching, const FrameOptions& options, int frames = 8)
{
    FrameOptions other = options;
    for (int i = 0; i < frames; ++i) {
        CAPTURE(i);
        other.view = FrameView(uint32_t(i) % kFrameViews);
        const auto expected = render(plain, walk(i, 2), options), actual = render(switching, walk(i, 2), other);
        for (size_t e = 0; e < 2; ++e) {
            const EyeCounts &a = expected[e].result.eyes[e], &b = actual[e].result.eyes[e];
            CHECK(sameBytes(expected[e].pixels, actual[e].pixels) == (other.view == FrameView::Picture));
            CHECK(a.anchors_decoded == b.anchors_decoded);
            CHECK(a.anchors_reused == b.anchors_reused);
            CHECK(a.gaussians_visible == b.gaussians_visible);
            CHECK(a.blend_evaluations == b.blend_evaluations);
        }
    }
}

// Over white a pixel is brighter than over black by the light that goes on behind it: that is the same in the picture and
// in the view. The rest of a pixel is a mixture of the levels' colours; in a model of one level, that level's alone.
inline void checkLevels(Renderer& renderer, const ModelView& model, const std::vector<EyeParams>& eyes,
                        FrameOptions options, float slack = 2e-6f)
{
    std::vector<Image<float>> drawn[2][2];
    for (const bool white : {false, true})
        for (const FrameView view : {FrameView::Picture, FrameView::Level}) {
            std::fill_n(options.background, 3, white ? 1.0f : 0.0f);
            options.view = view;
            drawn[white][view == FrameView::Level] = render(renderer, eyes, options);
        }
    for (size_t e = 0; e < eyes.size(); ++e) {
        const auto at = [&](bool white, bool level, size_t i) { return drawn[white][level][e].pixels[i]; };
        size_t other_light = 0, other_colours = 0;
        std::set<std::array<int, 3>> kinds;
        for (size_t i = 0; i < drawn[0][0][e].pixels.size(); i += 3) {
            float light = 0;
            for (size_t c = i; c < i + 3; ++c) {
                light = at(true, true, c) - at(false, true, c);
                other_light += std::abs(light - (at(true, false, c) - at(false, false, c))) > slack;
            }
            const float taken = 1 - light;
            if (taken < 0.5f)
                continue;
            std::array<int, 3> kind;
            for (size_t c = 0; c < 3; ++c)
                kind[c] = int(std::lround(20 * at(false, true, i + c) / taken));
            kinds.insert(kind);
            if (model.params->level_count == 1) {
                const FalseColour own = levelColour(model.levels[0].level);
                const float rgb[3] = {own.r, own.g, own.b};
                for (size_t c = 0; c < 3; ++c)
                    other_colours += std::abs(at(false, true, i + c) - taken * rgb[c]) > 1e-4f;
            }
        }
        CHECK(other_light == 0);
        CHECK(other_colours == 0);
        CHECK((kinds.size() > 3) == (model.params->level_count > 1));
    }
}

// Over black: nothing but that colour, more or less of it.
inline void checkOneColour(const std::vector<Image<float>>& images, const FalseColour& colour, float slack)
{
    const float rgb[3] = {colour.r, colour.g, colour.b};
    for (const Image<float>& image : images) {
        size_t others = 0, lit = 0;
        for (size_t p = 0; p < image.pixels.size(); p += 3) {
            const float most = std::max({image.pixels[p], image.pixels[p + 1], image.pixels[p + 2]});
            lit += most > 0.5f;
            const float scale = most / std::max({rgb[0], rgb[1], rgb[2]});
            for (size_t c = 0; c < 3; ++c)
                others += std::abs(image.pixels[p + c] - scale * rgb[c]) > slack;
        }
        CHECK(lit > 100);
        CHECK(others == 0);
    }
}

// ReusePolicy::Depth before a camera that stands still: all entries are of one age, 0 to max_depth and again.
inline void checkAges(Renderer& renderer, FrameOptions options, float slack = 1e-4f)
{
    std::fill_n(options.background, 3, 0.0f);
    const uint32_t period = options.reuse.max_depth + 1;
    for (uint32_t i = 0; i < 2 * period; ++i) {
        CAPTURE(i);
        options.view = i == period + 1 ? FrameView::Picture : FrameView::Age; // a picture makes nothing younger
        const auto images = render(renderer, viewEyes(0, 2), options);
        if (options.view == FrameView::Picture)
            continue;
        checkOneColour(images, ageColour(i % period), slack);
    }
}

} // namespace gsc::test
