// SPDX-License-Identifier: Apache-2.0
#include "player/lod_target.h"

#include "format/error.h"
#include "player/reuse_names.h"

#include <algorithm>

namespace gsc {

std::optional<LodControl> lodControl(const Scene& scene, const PlayOptions& options)
{
    if (!(options.target_ms > 0))
        return std::nullopt;
    const ModelParams& params = *scene.view().params;
    if (!(params.flags & kModelHasLevels) || params.level_clamp < 1)
        throw Error(ErrorCode::Unsupported,
                    formatString("%s: has one level of detail, expected several for --target-ms to choose from; leave "
                                 "it out, or play an Octree-GS model",
                                 options.input.c_str()));
    // all levels and, for forks of 2, what is up to sixteen times nearer than the finest asks for; no more, because it
    // would have to be climbed again
    const double coarsest = options.lod_bias - double(params.level_clamp) - 4;
    return LodControl({options.target_ms, options.lod_bias, std::max(coarsest, -kMaxLodBias)});
}

} // namespace gsc
