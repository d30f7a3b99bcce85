// SPDX-License-Identifier: Apache-2.0
#include "runtime/view/lod_lag.h"

#include "kernels/math/lod.h"

#include <algorithm>
#include <cmath>

namespace gsc {

float lodLeash(const ModelView& model, const FrameOptions& options)
{
    const ModelParams& params = *model.params;
    const LevelRule rule = LevelRule(params.level_rule);
    if (!(options.lod_hysteresis > 0) || !(params.flags & kModelHasLevels) || rule == LevelRule::None)
        return 0;
    int32_t finest = 0;
    for (uint32_t i = 0; i < params.level_count; ++i)
        finest = std::max(finest, std::min(model.levels[i].level, params.level_clamp));
    if (finest < 1)
        return 0;
    // note: an anchor's own level offset is never negative, and only moves the distance of its switch farther away
    const float ramp = rule == LevelRule::Progressive ? 1.0f : 0.5f * options.lod_fade;
    const float prediction = float(finest) - switchOffset(rule) + ramp;
    const float nearest =
        params.standard_dist / params.lod_scale * std::pow(float(params.fork), options.lod_bias - prediction);
    const float leash = nearest * (1 - std::pow(float(params.fork), -options.lod_hysteresis));
    return std::isfinite(leash) ? leash : 0.0f;
}

void LodLag::follow(const ModelView& model, const FrameOptions& options, const EyeParams* eyes, uint32_t eye_count,
                    EyeParams* chosen)
{
    const float leash = lodLeash(model, options);
    std::copy_n(eyes, eye_count, chosen);
    if (!(leash > 0)) {
        m_known = 0;
        return;
    }
    for (uint32_t e = 0; e < eye_count; ++e) {
        float* place = m_center[e];
        float behind[3], square = 0;
        for (int i = 0; i < 3; ++i) {
            behind[i] = e < m_known ? place[i] - eyes[e].center[i] : 0.0f;
            square += behind[i] * behind[i];
        }
        const float length = std::sqrt(square);
        // a place that is not finite is replaced by the camera's: the comparison is false
        const float kept = length <= leash ? 1.0f : length < INFINITY ? leash / length : 0.0f;
        for (int i = 0; i < 3; ++i) {
            // while the camera is within the leash, the place stays the same to the last bit
            if (e >= m_known || !(length <= leash))
                place[i] = kept > 0 ? eyes[e].center[i] + kept * behind[i] : eyes[e].center[i];
            chosen[e].center[i] = place[i];
        }
    }
    m_known = eye_count;
}

} // namespace gsc
