// SPDX-License-Identifier: Apache-2.0
// Evaluates the small networks for one anchor at a time, with the weights of MLPW, and finds weights in the sections
// MLPW and MLPP.
#pragma once

#include <gsc/frame_types.h>
#include "kernels/math/real.h"

namespace gsc {

// Computes y = W x + b, with W row-major [out][in].
template <typename Real>
GSC_HD void linear(const float* weight, const float* bias, uint32_t in, uint32_t out, const Real* x, Real* y)
{
    for (uint32_t o = 0; o < out; ++o) {
        Real sum = 0;
        for (uint32_t i = 0; i < in; ++i)
            sum += Real(weight[size_t(o) * in + i]) * x[i];
        y[o] = sum + Real(bias[o]);
    }
}

// Record of a network, null if the model has no feature bank and `kind` is that. Record i has kind i, as was checked
// when the file was opened. The kind tells the last activation: tanh of opacities, sigmoid of colours.
GSC_HD const MlpRecord* mlpRecord(const ModelView& model, MlpKind kind)
{
    const auto i = uint32_t(kind);
    return i < model.params->mlp_count ? reinterpret_cast<const MlpRecord*>(model.weights) + i : nullptr;
}

GSC_HD const float* mlpWeights(const ModelView& model, uint64_t offset)
{
    return reinterpret_cast<const float*>(model.weights + offset);
}

// Weights at byte `offset` of the section MLPP.
GSC_HD const float* packedWeights(const ModelView& model, uint64_t offset)
{
    return reinterpret_cast<const float*>(model.packed + offset);
}

// Evaluates Linear, ReLU, Linear; the caller applies the activation. `hidden` is scratch of mlp.hidden values.
template <typename Real>
GSC_HD void evaluateMlp(const ModelView& model, const MlpRecord& mlp, const Real* x, Real* hidden, Real* y)
{
    linear(mlpWeights(model, mlp.weight0), mlpWeights(model, mlp.bias0), mlp.in, mlp.hidden, x, hidden);
    for (uint32_t i = 0; i < mlp.hidden; ++i)
        hidden[i] = hidden[i] < Real(0) ? Real(0) : hidden[i]; // a ReLU that keeps NaN
    linear(mlpWeights(model, mlp.weight1), mlpWeights(model, mlp.bias1), mlp.hidden, mlp.out, hidden, y);
}

// Values from which the inputs of all heads are assembled, in addition to the features (format facts 4.1 and 4.3).
template <typename Real>
struct ViewInput {
    Real direction[3];
    Real distance;
    Real level;
    const float* appearance; // A values; null if the model has no appearance
};

// Assembles the input of one network in `x`; returns the number of values written.
template <typename Real>
GSC_HD uint32_t assembleInput(const ModelParams& params, uint32_t inputs, const Real* feature,
                              const ViewInput<Real>& view, Real* x)
{
    uint32_t n = 0;
    if (inputs & kMlpTakesFeature)
        for (uint32_t i = 0; i < params.feat_dim; ++i)
            x[n++] = feature[i];
    for (int i = 0; i < 3; ++i)
        x[n++] = view.direction[i];
    if (inputs & kMlpTakesDistance)
        x[n++] = view.distance;
    if (inputs & kMlpTakesLevel)
        x[n++] = view.level;
    if (inputs & kMlpTakesAppearance)
        for (uint32_t i = 0; i < params.appearance_dim; ++i)
            x[n++] = Real(view.appearance[i]);
    return n;
}

// Softmax of the three outputs of the feature bank, in place.
template <typename Real>
GSC_HD void softmax3(Real* v)
{
    const Real top = maxNumber(v[0], maxNumber(v[1], v[2]));
    Real sum = 0;
    for (int i = 0; i < 3; ++i) {
        v[i] = std::exp(v[i] - top);
        sum += v[i];
    }
    for (int i = 0; i < 3; ++i)
        v[i] /= sum;
}

// Feature `j` behind the bank: a sum of strided, repeated copies of the features, weighted by `w` (format facts 4.2).
template <typename Real>
GSC_HD Real bankFeature(const Real* feature, uint32_t feat_dim, uint32_t j, const Real* w)
{
    return feature[4 * (j % (feat_dim / 4))] * w[0] + feature[2 * (j % (feat_dim / 2))] * w[1] + feature[j] * w[2];
}

} // namespace gsc
