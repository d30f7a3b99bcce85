// SPDX-License-Identifier: Apache-2.0
#include "player/options/level_report.h"

#include <gsc/error.h>

#include <algorithm>

namespace gsc {

namespace {

// Precondition: there is a frame.
double leastBias(TimedFrames frames)
{
    return std::ranges::min(frames, {}, &TimedFrame::lod_bias).lod_bias;
}

} // namespace

OrderedJson foveaJson(const FrameChoice& choice)
{
    return unknownIfZero(choice.foveaPixels());
}

OrderedJson lodJson(const FrameChoice& choice, TimedFrames frames)
{
    OrderedJson used;
    if (choice.target_ms > 0) {
        const Spread bias = spreadOf(frames, &TimedFrame::lod_bias);
        used = {{"mean", bias.mean}, {"min", leastBias(frames)}, {"max", bias.max}};
    }
    return {{"lod_bias", choice.lod_bias},
            {"lod_fade", choice.lod_fade},
            {"lod_hysteresis", choice.lod_hysteresis},
            {"detail", choice.detailPixels()},
            {"fovea_pixels", foveaJson(choice)},
            {"target_ms", unknownIfZero(choice.target_ms)},
            {"lod_bias_used", std::move(used)}};
}

std::string targetText(const FrameChoice& choice, TimedFrames frames)
{
    if (!(choice.target_ms > 0))
        return {};
    const Spread bias = spreadOf(frames, &TimedFrame::lod_bias);
    return formatString("target %g ms: LOD bias %.2f mean, %.2f to %.2f\n", choice.target_ms, bias.mean,
                        leastBias(frames), bias.max);
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
