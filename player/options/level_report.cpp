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

OrderedJson foveaJson(const PlayOptions& options)
{
    return unknownIfZero(options.foveaPixels());
}

OrderedJson lodJson(const PlayOptions& options, TimedFrames frames)
{
    OrderedJson used;
    if (options.target_ms > 0) {
        const Spread bias = spreadOf(frames, &TimedFrame::lod_bias);
        used = {{"mean", bias.mean}, {"min", leastBias(frames)}, {"max", bias.max}};
    }
    return {{"lod_bias", options.lod_bias},
            {"lod_fade", options.lod_fade},
            {"lod_hysteresis", options.lod_hysteresis},
            {"fovea_pixels", foveaJson(options)},
            {"target_ms", unknownIfZero(options.target_ms)},
            {"lod_bias_used", std::move(used)}};
}

std::string targetText(const PlayOptions& options, TimedFrames frames)
{
    if (!(options.target_ms > 0))
        return {};
    const Spread bias = spreadOf(frames, &TimedFrame::lod_bias);
    return formatString("target %g ms: LOD bias %.2f mean, %.2f to %.2f\n", options.target_ms, bias.mean,
                        leastBias(frames), bias.max);
}

} // namespace gsc
