// SPDX-License-Identifier: Apache-2.0
#include "player/options/level_report.h"

#include <gsc/error.h>

#include <algorithm>

namespace gsc {

namespace {

// Precondition: there is a frame.
double leastOf(TimedFrames frames, double TimedFrame::*field)
{
    return std::ranges::min(frames, {}, field).*field;
}

// null without a target
OrderedJson usedJson(const FrameChoice& choice, TimedFrames frames, double TimedFrame::*field)
{
    if (!(choice.target_ms > 0))
        return {};
    const Spread used = spreadOf(frames, field);
    return {{"mean", used.mean}, {"min", leastOf(frames, field)}, {"max", used.max}};
}

} // namespace

OrderedJson foveaJson(const FrameChoice& choice)
{
    return unknownIfZero(choice.foveaPixels());
}

OrderedJson lodJson(const FrameChoice& choice, TimedFrames frames)
{
    return {{"lod_bias", choice.lod_bias},
            {"lod_fade", choice.lod_fade},
            {"lod_hysteresis", choice.lod_hysteresis},
            {"detail", choice.detailPixels()},
            {"fovea_pixels", foveaJson(choice)},
            {"target_ms", unknownIfZero(choice.target_ms)},
            {"lod_bias_used", usedJson(choice, frames, &TimedFrame::lod_bias)},
            {"detail_used", usedJson(choice, frames, &TimedFrame::detail)}};
}

std::string targetText(const FrameChoice& choice, TimedFrames frames)
{
    if (!(choice.target_ms > 0))
        return {};
    const Spread bias = spreadOf(frames, &TimedFrame::lod_bias), detail = spreadOf(frames, &TimedFrame::detail);
    return formatString("target %g ms: LOD bias %.2f mean, %.2f to %.2f; detail %.2f mean, %.2f to %.2f\n",
                        choice.target_ms, bias.mean, leastOf(frames, &TimedFrame::lod_bias), bias.max, detail.mean,
                        leastOf(frames, &TimedFrame::detail), detail.max);
}

std::string detailText(const FrameChoice& choice, TimedFrames frames)
{
    if (choice.detailPixels() == 0)
        return {};
    const auto mean = [&](uint64_t CoarseCounts::*field) { return groupsPerFrame(frames, field).mean; };
    return formatString("detail %g: groups per frame %.0f near, %.0f kept, %.0f stale, %.0f made\n",
                        choice.detailPixels(), mean(&CoarseCounts::near), mean(&CoarseCounts::kept),
                        mean(&CoarseCounts::stale), mean(&CoarseCounts::made));
}

} // namespace gsc
