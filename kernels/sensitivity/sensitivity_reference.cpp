// SPDX-License-Identifier: Apache-2.0
#include "kernels/sensitivity/sensitivity.h"

#include <algorithm>

namespace gsc {

namespace {

struct Drawn {
    double opacity; // 0 below kOpacityFloor
    double color[3];
    double covariance[3][3];
    double whitening[3][3]; // M^-1/2 with thin axes lengthened
};

using Matrix = double[3][3];

void multiply(const Matrix& a, const Matrix& b, Matrix& out)
{
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j)
            out[i][j] = a[i][0] * b[0][j] + a[i][1] * b[1][j] + a[i][2] * b[2][j];
}

void spread(const Covariance3<double>& m, Matrix& out)
{
    const double rows[3][3] = {{m.xx, m.xy, m.xz}, {m.xy, m.yy, m.yz}, {m.xz, m.yz, m.zz}};
    std::copy_n(&rows[0][0], 9, &out[0][0]);
}

// What every offset of an anchor decodes to. note: decodeAnchor() leaves out those below the floor, so this does not
// call it
std::vector<Drawn> drawnAt(const ModelView& model, uint32_t chunk, uint32_t local, int32_t appearance,
                           const double* direction, double distance)
{
    const ModelParams& params = *model.params;
    const Networks nets = findNetworks(model);
    const uint32_t F = params.feat_dim, K = params.n_offsets;
    ViewInput<double> view{};
    std::copy_n(direction, 3, view.direction);
    view.distance = distance;
    view.level = anchorLevel(model, chunk);
    // without a row the appearance counts as zero, as in the fast version
    const std::vector<float> none(params.appearance_dim);
    view.appearance = model.embedding != nullptr && appearance >= 0
                          ? model.embedding + size_t(appearance) * params.appearance_dim
                          : none.data();
    std::vector<double> feature(F), input(F + 5 + params.appearance_dim), hidden(F);
    const float* raw = model.arrays[chunk].feature + size_t(F) * local;
    std::copy_n(raw, F, feature.data());
    if (nets.bank != nullptr) {
        double weights[3];
        const std::vector<double> plain = feature;
        assembleInput<double>(params, nets.bank->inputs, nullptr, view, input.data());
        evaluateMlp(model, *nets.bank, input.data(), hidden.data(), weights);
        softmax3(weights);
        for (uint32_t j = 0; j < F; ++j)
            feature[j] = bankFeature(plain.data(), F, j, weights);
    }
    std::vector<double> opacity(K), covariance(size_t(7) * K), color(size_t(3) * K);
    const auto evaluate = [&](const MlpRecord& mlp, std::vector<double>& out) {
        assembleInput(params, mlp.inputs, feature.data(), view, input.data());
        evaluateMlp(model, mlp, input.data(), hidden.data(), out.data());
    };
    evaluate(*nets.opacity, opacity);
    evaluate(*nets.covariance, covariance);
    evaluate(*nets.color, color);

    std::vector<Drawn> drawn(K);
    const float* log_scale = model.arrays[chunk].scale + size_t(6) * local;
    for (uint32_t k = 0; k < K; ++k) {
        const double o = activate(Activation(nets.opacity->activation), opacity[k]);
        drawn[k].opacity = o < double(kOpacityFloor) ? 0 : o;
        double scale[3], whitening[3], q[4], longest = 0;
        for (int i = 0; i < 3; ++i) {
            scale[i] = std::exp(double(log_scale[3 + i])) * sigmoid(covariance[7 * k + size_t(i)]);
            longest = std::max(longest, scale[i]);
            drawn[k].color[i] = activate(Activation(nets.color->activation), color[3 * k + size_t(i)]);
        }
        // covariance3() squares what it is given: fourth roots of the inverse make M^-1/2
        for (int i = 0; i < 3; ++i)
            whitening[i] = 1 / std::sqrt(std::hypot(scale[i], kThinAxis * longest));
        std::copy_n(&covariance[7 * k + 3], 4, q);
        normalizeQuaternion(q);
        spread(covariance3(scale, q), drawn[k].covariance);
        spread(covariance3(whitening, q), drawn[k].whitening);
    }
    return drawn;
}

double squaredChange(const Drawn& a, const Drawn& b, const SensitivityWeights& weights = kSensitivityWeights)
{
    if (a.opacity == 0 && b.opacity == 0)
        return 0;
    double color = 0;
    for (int c = 0; c < 3; ++c) {
        const double d = b.opacity * b.color[c] - a.opacity * a.color[c];
        color = std::max(color, d * d);
    }
    Matrix difference, left, both;
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j)
            difference[i][j] = b.covariance[i][j] - a.covariance[i][j];
    multiply(a.whitening, difference, left);
    multiply(left, a.whitening, both);
    double shape = 0;
    for (const auto& row : both)
        for (const double v : row)
            shape += v * v / 4;
    const double opacity = weights.opacity * (b.opacity - a.opacity);
    return color + opacity * opacity + weights.scale * weights.scale * a.opacity * a.opacity * shape;
}

} // namespace

double drawnChangeReference(const ModelView& model, uint32_t chunk, uint32_t local, int32_t appearance,
                            const double* direction0, double distance0, const double* direction1, double distance1,
                            const SensitivityWeights& weights)
{
    const std::vector<Drawn> before = drawnAt(model, chunk, local, appearance, direction0, distance0);
    const std::vector<Drawn> after = drawnAt(model, chunk, local, appearance, direction1, distance1);
    double sum = 0;
    size_t living = 0;
    for (size_t k = 0; k < before.size(); ++k) {
        sum += squaredChange(before[k], after[k], weights);
        living += before[k].opacity > 0 || after[k].opacity > 0;
    }
    return living > 0 ? std::sqrt(sum / double(living)) : 0;
}

void viewSensitivityReference(const ModelView& model, uint32_t chunk, uint32_t local, int32_t appearance,
                              double& direction, double& distance)
{
    constexpr double kStep = 1e-6;
    direction = distance = 0;
    for (uint32_t p = 0; p < kProbes; ++p) {
        const SensitivityProbe probe = sensitivityProbe(p, sensitivityDistance(model, chunk));
        const std::vector<Drawn> before = drawnAt(model, chunk, local, appearance, probe.direction, probe.distance);
        double living = 0;
        for (size_t k = p % kOffsetStep; k < before.size(); k += kOffsetStep)
            living += before[k].opacity != 0; // or NaN
        living = std::max(living, 1.0);
        double turned[3];
        for (int i = 0; i < 3; ++i)
            turned[i] = probe.direction[i] + kStep * probe.tangent[i];
        const std::vector<Drawn> after = drawnAt(model, chunk, local, appearance, turned, probe.distance);
        double squares = 0;
        for (size_t k = p % kOffsetStep; k < before.size(); k += kOffsetStep)
            squares += 2 * squaredChange(before[k], after[k]);
        direction = std::max(direction, std::sqrt(squares / living) / kStep);
        if (takesDistance(model)) {
            const std::vector<Drawn> moved =
                drawnAt(model, chunk, local, appearance, probe.direction, probe.distance * (1 + kStep));
            squares = 0;
            for (size_t k = p % kOffsetStep; k < before.size(); k += kOffsetStep)
                squares += squaredChange(before[k], moved[k]);
            distance = std::max(distance, std::sqrt(squares / living) / kStep);
        }
    }
}

} // namespace gsc
