// SPDX-License-Identifier: Apache-2.0
#include "player/frames/lod_target.h"

#include <gsc/error.h>
#include "runtime/records/reuse_names.h"

#include <algorithm>

namespace gsc {

bool hasLevels(const Scene& scene)
{
    const ModelParams& params = *scene.view().params;
    return (params.flags & kModelHasLevels) && params.level_clamp >= 1;
}

void checkLevelChoice(const Scene& scene, const std::string& model, const std::string& what, double value)
{
    if (value != 0 && !hasLevels(scene))
        throw Error(ErrorCode::Usage,
                    formatString("%s %g: has no effect on %s, which has one level of detail, expected several; leave "
                                 "it out, or play an Octree-GS model",
                                 what.c_str(), value, model.c_str()));
}

void checkLevelOptions(const Scene& scene, const std::string& model, const FrameChoice& choice, bool levels_hold_target)
{
    checkLevelChoice(scene, model, "--lod-bias", choice.lod_bias);
    checkLevelChoice(scene, model, "--lod-fade", choice.lod_fade);
    checkLevelChoice(scene, model, "--lod-hysteresis", choice.lod_hysteresis);
    if (levels_hold_target)
        checkLevelChoice(scene, model, "--target-ms", choice.target_ms);
}

double coarsestBias(const Scene& scene, const FrameChoice& choice)
{
    // all levels and, for forks of 2, what is up to sixteen times nearer than the finest asks for; no more, because it
    // would have to be climbed again
    const double coarsest = choice.lod_bias - double(scene.view().params->level_clamp) - 4;
    return std::max(coarsest, -kMaxLodBias);
}

std::optional<LodControl> lodControl(const Scene& scene, const FrameChoice& choice)
{
    if (!(choice.target_ms > 0))
        return std::nullopt;
    return LodControl({choice.target_ms, choice.lod_bias, coarsestBias(scene, choice)});
}

} // namespace gsc
