// SPDX-License-Identifier: Apache-2.0
// Tests whether one eye sees one anchor.
#pragma once

#include "kernels/math/anchor.h"
#include "kernels/math/band.h"
#include "kernels/math/lod.h"
#include "kernels/math/projection.h"

namespace gsc {

template <typename Real>
struct AnchorDecision {
    bool visible;
    Real fraction; // opacity factor of the anchor, 1 unless levels fade
};

// Tests the level alone. `lod_shift` is lodShift() of the anchor's level.
template <typename Real>
GSC_HD AnchorDecision<Real> testLevel(const ModelView& model, const Real* center, Real lod_bias, Real lod_fade,
                                      uint32_t chunk, uint32_t local, Real lod_shift)
{
    const ModelParams& params = *model.params;
    if (!(params.flags & kModelHasLevels) || params.level_rule == uint32_t(LevelRule::None))
        return {true, Real(1)};
    const Vec3<float> stored = anchorPosition(model, chunk, local);
    const int32_t level = anchorLevel(model, chunk);
    const Real predicted = predictedLevel<Real>(params, {Real(stored.x), Real(stored.y), Real(stored.z)}, lod_shift,
                                                center, Real(anchorExtraLevel(model, chunk, local)), lod_bias);
    const LevelChoice<Real> choice = chooseLevel(LevelRule(params.level_rule), predicted, params.level_clamp, lod_fade);
    return {level <= choice.level, level == choice.level ? choice.fraction : Real(1)};
}

// Tests the level first, then the visibility (format facts 5.1).
template <typename Real>
GSC_HD AnchorDecision<Real> testAnchor(const ModelView& model, const EyeOf<Real>& eye, const RasterConstants& rules,
                                       Real lod_bias, Real lod_fade, uint32_t chunk, uint32_t local, Real lod_shift)
{
    AnchorDecision<Real> decision = testLevel<Real>(model, eye.center, lod_bias, lod_fade, chunk, local, lod_shift);
    if (!decision.visible)
        return decision;
    const Vec3<float> stored = anchorPosition(model, chunk, local);
    const Vec3<Real> p{Real(stored.x), Real(stored.y), Real(stored.z)};
    const float* log_scale = model.arrays[chunk].scale + size_t(6) * local;
    const float* rotation = anchorRotation(model, chunk, local);
    const Real scale[3] = {std::exp(Real(log_scale[0])), std::exp(Real(log_scale[1])), std::exp(Real(log_scale[2]))};
    Real q[4] = {Real(rotation[0]), Real(rotation[1]), Real(rotation[2]), Real(rotation[3])};
    normalizeQuaternion(q);
    decision.visible = footprint<Real>(eye, rules, p, scale, q).visible;
    return decision;
}

// Returns true if a Gaussian of the anchor can touch a tile of the band; may also return true if none can.
GSC_HD bool anchorMayTouch(const ModelView& model, const EyeBand& band, uint32_t chunk, uint32_t local)
{
    const Vec3<float> p = anchorPosition(model, chunk, local);
    const uint32_t K = model.params->n_offsets;
    const float* log_scale = model.arrays[chunk].scale + size_t(6) * local;
    const float* offset = model.arrays[chunk].offset + size_t(3) * K * local;
    const float extent[3] = {std::exp(log_scale[0]), std::exp(log_scale[1]), std::exp(log_scale[2])};
    const float sigma = std::exp(maxNumber(log_scale[3], maxNumber(log_scale[4], log_scale[5])));
    const bool masks = (model.params->flags & kModelMaskedSlots) != 0;
    for (uint32_t k = 0; k < K; ++k, offset += 3) {
        if (isMaskedSlot(masks, offset))
            continue;
        const float at[3] = {p.x + offset[0] * extent[0], p.y + offset[1] * extent[1], p.z + offset[2] * extent[2]};
        if (mayTouch(band, at, at, sigma))
            return true;
    }
    return false;
}

} // namespace gsc
