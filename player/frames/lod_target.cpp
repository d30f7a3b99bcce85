// SPDX-License-Identifier: Apache-2.0
#include "player/frames/lod_target.h"

#include <gsc/error.h>
#include "runtime/records/reuse_names.h"

#include <algorithm>

namespace gsc {

namespace {

// Lowest level bias (FrameOptions::lod_bias) that a time target may choose.
double coarsestBias(const Scene& scene, const FrameChoice& choice)
{
    // below the chosen bias by all levels, and by 4 more: where a level halves the distance, sixteen times the
    // distance beyond the finest level. No more, because the bias has to climb back
    const double coarsest = choice.lod_bias - double(scene.view().params->level_clamp) - 4;
    return std::max(coarsest, -kMaxLodBias);
}

} // namespace

bool hasLevels(const Scene& scene)
{
    const ModelParams& params = *scene.view().params;
    return (params.flags & kModelHasLevels) && params.level_clamp >= 1;
}

void checkLevelChoice(const Scene& scene, const std::string& model, const std::string& what, double value)
{
    if (value != 0 && !hasLevels(scene))
        throw Error(ErrorCode::Usage, formatString("%s %g", what.c_str(), value),
                    "has no effect on " + model + ", which has one level of detail", "several",
                    "leave it out, or play an Octree-GS model");
}

void checkLevelOptions(const Scene& scene, const std::string& model, const FrameChoice& choice)
{
    checkLevelChoice(scene, model, "--lod-bias", choice.lod_bias);
    checkLevelChoice(scene, model, "--lod-fade", choice.lod_fade);
    checkLevelChoice(scene, model, "--lod-hysteresis", choice.lod_hysteresis);
}

bool drawsDetail(const FrameChoice& choice, const std::string& backend, Tier runs)
{
    if (choice.tier != Tier::Fast || !choice.on_path || choice.reuse.policy != ReusePolicy::None)
        return false;
    return backend == "cpu" || (backend == "cuda" && runs == Tier::Fast);
}

std::optional<FrameGuard> frameGuard(const Scene& scene, const FrameChoice& choice, Guarded guarded)
{
    if (!(choice.target_ms > 0))
        return std::nullopt;
    FrameGuardOptions guard;
    guard.target_ms = choice.target_ms;
    guard.finest_bias = guard.coarsest_bias = choice.lod_bias;
    if (hasLevels(scene))
        guard.coarsest_bias = coarsestBias(scene, choice);
    if (guarded.periphery)
        guard.fovea_pixels = choice.foveaPixels();
    guard.detail = guard.most_detail = choice.detailPixels();
    if (guarded.detail)
        guard.most_detail = std::max(guard.detail, FrameGuard::kGuardedDetail);
    if (!hasLevels(scene) && !guarded.detail && guard.fovea_pixels == 0)
        return std::nullopt;
    return FrameGuard(guard);
}

std::optional<FrameGuard> checkedGuard(const Scene& scene, const std::string& model, const FrameChoice& choice,
                                       Guarded guarded)
{
    std::optional<FrameGuard> guard = frameGuard(scene, choice, guarded);
    if (choice.target_ms > 0 && !guard)
        throw Error(
            ErrorCode::Usage, formatString("--target-ms %g", choice.target_ms),
            formatString(
                "has no effect on %s, which has one level of detail and is not drawn coarse with this backend%s tier%s",
                model.c_str(), choice.on_path ? " and" : ",", choice.on_path ? "" : " and cameras"),
            "something to give up",
            formatString("pass --tier fast without --reuse%s, or leave it out",
                         choice.on_path ? " or, in a headset or window, --foveation fixed"
                                        : " and two cameras or more of a trajectory"));
    return guard;
}

} // namespace gsc
