// SPDX-License-Identifier: Apache-2.0
// Colours of FrameView, with equal bits on host and device, so that a legend can be drawn from these functions.
#pragma once

#include <gsc/frame_types.h>

#include <cmath>

namespace gsc {

struct FalseColour {
    float r, g, b;
};

// log2(1 + value), linear between powers of two. It is exact; a device's logarithm differs from a host's by a rounding.
GSC_HD float logSteps(uint32_t value)
{
    const uint32_t n = value < 0x00ffffffu ? value + 1 : 0x01000000u; // up to 2^24, so that it is exact as a float
    uint32_t power = 0;
    while (n >> (power + 1) != 0)
        ++power;
    return float(power) + float(n - (1u << power)) / float(1u << power); // exact, since it divides by a power of two
}

// Colour at share `t` of the way from `a` to `b`. Fused operations on host and device alike.
GSC_HD FalseColour between(const FalseColour& a, const FalseColour& b, float t)
{
    return {std::fma(t, b.r - a.r, a.r), std::fma(t, b.g - a.g, a.g), std::fma(t, b.b - a.b, a.b)};
}

// Colour for FrameView::Level, from LevelRecord::level: one of twelve colours, which are repeated from level 12 on.
GSC_HD FalseColour levelColour(int32_t level)
{
    const FalseColour colours[12] = {
        {0.90f, 0.10f, 0.10f}, // red
        {0.10f, 0.70f, 0.15f}, // green
        {0.15f, 0.35f, 0.95f}, // blue
        {0.95f, 0.85f, 0.10f}, // yellow
        {0.80f, 0.15f, 0.85f}, // magenta
        {0.10f, 0.80f, 0.85f}, // cyan
        {1.00f, 0.50f, 0.05f}, // orange
        {0.45f, 0.20f, 0.70f}, // violet
        {0.65f, 0.95f, 0.35f}, // lime
        {0.60f, 0.35f, 0.15f}, // brown
        {1.00f, 0.65f, 0.80f}, // pink
        {0.70f, 0.70f, 0.70f}, // grey
    };
    return colours[(level % 12 + 12) % 12];
}

// Colour for FrameView::Age, from the frames since the anchor was decoded or its coarse copy made: blue for 0, cyan for
// 3, green for 15, yellow for 63, red from 255 on. Between these numbers it changes linearly with logSteps().
GSC_HD FalseColour ageColour(uint32_t frames)
{
    const FalseColour blue{0, 0, 1}, cyan{0, 1, 1}, green{0, 1, 0}, yellow{1, 1, 0}, red{1, 0, 0};
    const float at = 0.5f * logSteps(frames);
    return at < 1   ? between(blue, cyan, at)
           : at < 2 ? between(cyan, green, at - 1)
           : at < 3 ? between(green, yellow, at - 2)
           : at < 4 ? between(yellow, red, at - 3)
                    : red;
}

// Colour for FrameView::Cost, from the Gaussians evaluated for a pixel: black for 0, blue for 7, red for 63, yellow for
// 511, white from 4095 on. Between these numbers it changes linearly with logSteps(). No two counts below 4095 have
// equal colours.
GSC_HD FalseColour costColour(uint32_t evaluations)
{
    const FalseColour black{0, 0, 0}, blue{0, 0, 1}, red{1, 0, 0}, yellow{1, 1, 0}, white{1, 1, 1};
    constexpr float kThird = 1.0f / 3.0f;
    const float at = logSteps(evaluations);
    return at < 3    ? between(black, blue, at * kThird)
           : at < 6  ? between(blue, red, (at - 3) * kThird)
           : at < 9  ? between(red, yellow, (at - 6) * kThird)
           : at < 12 ? between(yellow, white, (at - 9) * kThird)
                     : white;
}

// How a group of anchors is drawn, for FrameView::Detail; the names are those of CoarseCounts.
enum class GroupSource : uint32_t { Near = 0, Kept = 1, Stale = 2, Made = 3 };

// Colour for FrameView::Detail; people with any colour vision can tell the four apart.
GSC_HD FalseColour detailColour(GroupSource source)
{
    const FalseColour colours[4] = {
        {0.85f, 0.85f, 0.80f}, // near: grey
        {0.00f, 0.45f, 0.80f}, // kept: blue
        {0.90f, 0.40f, 0.00f}, // stale: orange
        {0.00f, 0.70f, 0.45f}, // made: green
    };
    return colours[uint32_t(source) & 3u];
}

// Returns true if the view draws Gaussians in other colours than their own.
GSC_HD bool paintsGaussians(FrameView view)
{
    return view == FrameView::Level || view == FrameView::Age || view == FrameView::Detail;
}

} // namespace gsc
