// SPDX-License-Identifier: Apache-2.0
// Decodes the Gaussians of one anchor as one eye sees it (format facts 4), scalar.
#pragma once

#include "kernels/math/anchor.h"
#include "kernels/math/mlp.h"
#include "kernels/math/projection.h"

namespace gsc {

// Number of scratch values that decodeAnchor() needs: features, features behind the bank, input, hidden units, outputs
// of the three heads.
GSC_HD size_t decodeScratch(const ModelParams& params)
{
    return size_t(4) * params.feat_dim + 5 + params.appearance_dim + size_t(11) * params.n_offsets;
}

template <typename Real>
GSC_HD ViewInput<Real> viewInput(const ModelView& model, const Real* center, const Vec3<Real>& p, uint32_t chunk,
                                 int32_t appearance)
{
    ViewInput<Real> view{};
    const Real v[3] = {p.x - center[0], p.y - center[1], p.z - center[2]};
    view.distance = std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
    for (int i = 0; i < 3; ++i)
        // note: NaN if the eye is at the anchor itself, whose Gaussians are then dropped (format facts, trap 17)
        view.direction[i] = v[i] / view.distance;
    view.level = Real(anchorLevel(model, chunk));
    if (model.embedding != nullptr && appearance >= 0)
        view.appearance = model.embedding + size_t(appearance) * model.params->appearance_dim;
    return view;
}

// Networks of one anchor, for the eye that `view` describes. `scratch`: decodeScratch() values, which must live longer
// than this object.
template <typename Real>
struct AnchorNetworks {
    const ModelView& model;
    const ViewInput<Real>& view;
    const float* log_scale; // logarithms of the anchor's 6 scales
    Real *feature, *input, *hidden, *opacity, *covariance, *color;

    GSC_HD AnchorNetworks(const ModelView& m, const ViewInput<Real>& v, uint32_t chunk, uint32_t local, Real* scratch)
        : model(m), view(v), log_scale(m.arrays[chunk].scale + size_t(6) * local), feature(scratch)
    {
        const ModelParams& params = *model.params;
        const uint32_t F = params.feat_dim, K = params.n_offsets;
        Real* banked = feature + F;
        input = banked + F;
        hidden = input + F + 5 + params.appearance_dim;
        opacity = hidden + F;
        covariance = opacity + K;
        color = covariance + size_t(7) * K;
        const float* raw = model.arrays[chunk].feature + size_t(F) * local;
        for (uint32_t j = 0; j < F; ++j)
            feature[j] = Real(raw[j]);
        if (mlpRecord(model, MlpKind::FeatureBank) == nullptr)
            return;
        Real weights[3];
        evaluate(MlpKind::FeatureBank, weights);
        softmax3(weights);
        for (uint32_t j = 0; j < F; ++j)
            banked[j] = bankFeature(feature, F, j, weights);
        feature = banked;
    }

    GSC_HD void evaluate(MlpKind kind, Real* out) const
    {
        const MlpRecord& mlp = *mlpRecord(model, kind);
        assembleInput(*model.params, mlp.inputs, feature, view, input);
        evaluateMlp(model, mlp, input, hidden, out);
    }

    // Sets scale, colour and rotation of Gaussian k; both networks must have been evaluated.
    GSC_HD void setShape(uint32_t k, GaussianOf<Real>& g) const
    {
        for (int i = 0; i < 3; ++i) {
            g.scale[i] = std::exp(Real(log_scale[3 + i])) * sigmoid(covariance[7 * k + i]);
            g.color[i] = sigmoid(color[3 * k + i]);
        }
        for (int i = 0; i < 4; ++i)
            g.rotation[i] = covariance[7 * k + 3 + i];
        normalizeQuaternion(g.rotation);
    }
};

// Calls emit(GaussianOf<Real>) for every slot whose opacity is kOpacityFloor or more, k ascending. Returns true if any
// opacity was positive; that decides between black and the background when no Gaussian is left (format facts, trap 25).
template <typename Real, typename Emit>
GSC_HD bool decodeAnchor(const ModelView& model, const Real* center, uint32_t chunk, uint32_t local, Real fraction,
                         int32_t appearance, Real* scratch, Emit&& emit)
{
    const uint32_t K = model.params->n_offsets;
    const Vec3<float> stored = anchorPosition(model, chunk, local);
    const Vec3<Real> p{Real(stored.x), Real(stored.y), Real(stored.z)};
    const ViewInput<Real> view = viewInput<Real>(model, center, p, chunk, appearance);
    const AnchorNetworks<Real> anchor(model, view, chunk, local, scratch);
    Real* const opacity = anchor.opacity;
    anchor.evaluate(MlpKind::Opacity, opacity);
    const bool masks = (model.params->flags & kModelMaskedSlots) != 0;
    const float* offset = model.arrays[chunk].offset + size_t(3) * K * local;
    bool any_positive = false, any_drawn = false;
    for (uint32_t k = 0; k < K; ++k) {
        opacity[k] = std::tanh(opacity[k]) * fraction;
        any_positive |= opacity[k] > Real(0);
        if (isMaskedSlot(masks, offset + 3 * k))
            opacity[k] = Real(0);
        any_drawn |= opacity[k] >= Real(kOpacityFloor);
    }
    if (!any_drawn)
        return any_positive;
    anchor.evaluate(MlpKind::Covariance, anchor.covariance);
    anchor.evaluate(MlpKind::Color, anchor.color);

    for (uint32_t k = 0; k < K; ++k) {
        if (!(opacity[k] >= Real(kOpacityFloor)))
            continue;
        GaussianOf<Real> g{};
        const Real at[3] = {p.x, p.y, p.z};
        for (int i = 0; i < 3; ++i)
            g.position[i] = at[i] + Real(offset[3 * k + i]) * std::exp(Real(anchor.log_scale[i]));
        anchor.setShape(k, g);
        g.opacity = opacity[k];
        g.order = emissionOrder(model, chunk, local, k);
        emit(g);
    }
    return any_positive;
}

} // namespace gsc
