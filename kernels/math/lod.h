// SPDX-License-Identifier: Apache-2.0
// Rules of Octree-GS that tell which levels of detail of a model are shown (format facts 5.2).
#pragma once

#include <gsc/frame_types.h>
#include "kernels/math/real.h"

namespace gsc {

// fork^level, in the precision of the trainers' code.
template <typename Real>
GSC_HD Real forkPower(uint32_t fork, int32_t level)
{
    return std::pow(Real(fork), Real(level));
}

// Half a cell of the level, which is added to every coordinate of an anchor before its distance is taken (format facts,
// trap 11); 0 for models without that rule.
template <typename Real>
GSC_HD Real lodShift(const ModelParams& params, int32_t level)
{
    if (!(params.flags & kModelLodHalfCell))
        return Real(0);
    return Real(params.voxel_size) / Real(2) / forkPower<Real>(params.fork, level);
}

// Level wanted at the distance of `p` from `center`, before rounding. note: on CUDA, dividing by log2(fork) is a
// multiplication by its reciprocal; for fork 2 that makes no difference
template <typename Real>
GSC_HD Real predictedLevel(const ModelParams& params, const Vec3<Real>& p, Real shift, const Real* center, Real extra,
                           Real bias)
{
    const Real dx = p.x + shift - center[0], dy = p.y + shift - center[1], dz = p.z + shift - center[2];
    const Real distance = std::sqrt(dx * dx + dy * dy + dz * dz) * Real(params.lod_scale);
    Real level = std::log2(Real(params.standard_dist) / distance);
    if (params.fork != 2)
        level *= Real(1) / std::log2(Real(params.fork));
    return level + extra + bias;
}

// An anchor is shown from a predicted level on that lies this far below its own level.
GSC_HD float switchOffset(LevelRule rule)
{
    return rule == LevelRule::Floor ? 0.0f : rule == LevelRule::Round ? 0.5f : 1.0f;
}

// Returns true if anchors have opacity factors: by the model's own rule, or because lod_fade wants smooth transitions.
GSC_HD bool levelsFade(const ModelParams& params, float lod_fade)
{
    const LevelRule rule = LevelRule(params.level_rule);
    return rule == LevelRule::Progressive ||
           (lod_fade > 0 && rule != LevelRule::None && (params.flags & kModelHasLevels) != 0);
}

template <typename Real>
struct LevelChoice {
    int32_t level; // anchors of this level and of coarser ones are shown
    Real fraction; // opacity factor of the anchors of exactly this level; 1 if levels do not fade
};

// Choice of levels with smooth transitions: if the trainers' rule switches a level on at prediction t, its opacity
// rises linearly from 0 at t - fade / 2 to 1 at t + fade / 2. At most one level fades at a time, because fade is at
// most 1. Level 0 is always fully shown, as by the trainers' rule.
template <typename Real>
GSC_HD LevelChoice<Real> fadeLevel(LevelRule rule, Real predicted, int32_t level_clamp, Real fade)
{
    const Real t = predicted + Real(switchOffset(rule)) + fade / Real(2);
    if (!(t >= Real(1)) || level_clamp < 1)
        return {level_clamp < 0 ? level_clamp : 0, Real(1)};
    if (t >= Real(level_clamp) + Real(1))
        return {level_clamp, Real(1)};
    const Real whole = std::floor(t), fraction = (t - whole) / fade;
    return {int32_t(whole), fraction < Real(1) ? fraction : Real(1)};
}

// Choice of levels by the rule of the model. note: clamped as a float, because a conversion to integer saturates on
// CUDA, while on x86 it would turn "finest" into "coarsest" (format facts, trap 29)
template <typename Real>
GSC_HD LevelChoice<Real> chooseLevel(LevelRule rule, Real predicted, int32_t level_clamp, Real fade = Real(0))
{
    const Real top = Real(level_clamp);
    if (rule == LevelRule::Progressive) {
        const Real low = Real(0.9999f), high = top + Real(0.9999f);
        Real t = predicted + Real(1);
        t = t < low ? low : (t > high ? high : t);
        const Real whole = std::floor(t);
        return {saturatingInt(whole), t - whole};
    }
    if (fade > Real(0))
        return fadeLevel(rule, predicted, level_clamp, fade);
    Real r = predicted;
    if (rule == LevelRule::Floor)
        r = std::floor(predicted);
    else if (rule == LevelRule::Ceil)
        r = std::ceil(predicted);
    else
        r = std::nearbyint(predicted); // rounds halves to the even number
    r = r < Real(0) ? Real(0) : (r > top ? top : r);
    return {saturatingInt(r), Real(1)};
}

// Returns true if anchors appear and disappear with distance.
GSC_HD bool levelsSwitch(const ModelParams& params)
{
    return (params.flags & kModelHasLevels) != 0 && params.level_rule != uint32_t(LevelRule::None);
}

// Returns true if an anchor of `level` is shown from the viewpoint `center`, and sets fraction to its opacity factor.
// shift: lodShift() of the level; extra: extra_level of the anchor.
template <typename Real>
GSC_HD bool levelShows(const ModelParams& params, int32_t level, const Vec3<Real>& p, Real shift, Real extra,
                       const Real* center, Real lod_bias, Real lod_fade, Real& fraction)
{
    fraction = Real(1);
    if (!levelsSwitch(params))
        return true;
    const Real predicted = predictedLevel<Real>(params, p, shift, center, extra, lod_bias);
    const LevelChoice<Real> choice = chooseLevel(LevelRule(params.level_rule), predicted, params.level_clamp, lod_fade);
    if (level == choice.level)
        fraction = choice.fraction;
    return level <= choice.level;
}

} // namespace gsc
