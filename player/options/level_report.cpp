// SPDX-License-Identifier: Apache-2.0
#include "player/options/level_report.h"

#include <gsc/error.h>

#include <algorithm>

namespace gsc {

namespace {

UsedRange usedRange(TimedFrames frames, double TimedFrame::*field)
{
    const Spread used = spreadOf(frames, field);
    return {used.mean, std::ranges::min(frames, {}, field).*field, used.max};
}

OrderedJson usedJson(const std::optional<TargetFacts>& facts, UsedRange TargetFacts::*field)
{
    return facts ? toJson((*facts).*field) : OrderedJson();
}

} // namespace

std::optional<TargetFacts> targetFacts(const FrameChoice& choice, TimedFrames frames)
{
    if (!(choice.target_ms > 0))
        return std::nullopt;
    return TargetFacts{usedRange(frames, &TimedFrame::lod_bias), usedRange(frames, &TimedFrame::detail)};
}

OrderedJson lodJson(const FrameChoice& choice, TimedFrames frames)
{
    const std::optional<TargetFacts> used = targetFacts(choice, frames);
    return {{"lod_bias", choice.lod_bias},
            {"lod_fade", choice.lod_fade},
            {"lod_hysteresis", choice.lod_hysteresis},
            {"detail", choice.detailPixels()},
            {"fovea_pixels", unknownIfZero(choice.foveaPixels())},
            {"target_ms", unknownIfZero(choice.target_ms)},
            {"lod_bias_used", usedJson(used, &TargetFacts::lod_bias)},
            {"detail_used", usedJson(used, &TargetFacts::detail)}};
}

std::string targetText(double target_ms, const std::optional<TargetFacts>& used)
{
    if (!used)
        return {};
    const UsedRange &bias = used->lod_bias, &detail = used->detail;
    return formatString("target %g ms: LOD bias %.2f mean, %.2f to %.2f; detail %.2f mean, %.2f to %.2f\n", target_ms,
                        bias.mean, bias.min, bias.max, detail.mean, detail.min, detail.max);
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
