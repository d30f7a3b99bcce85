// SPDX-License-Identifier: Apache-2.0
#include "kernels/sensitivity/sensitivity.h"

#include <algorithm>

namespace gsc {

namespace {

struct Drawn {
    double opacity; // 0 if it is below kOpacityFloor
    double color[3];
    double covariance[3][3];
    double whitening[3][3]; // M^-1/2 with thin axes made longer
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

// Decodes every Gaussian of an anchor. note: not by decodeAnchor(), which leaves out opacities below the floor
std::vector<Drawn> drawnAt(const ModelView& model, uint32_t chunk, uint32_t local, int32_t appearance,
                           const double* direction, double distance)
{
    const ModelParams& params = *model.params;
    ViewInput<double> view{};
    std::copy_n(direction, 3, view.direction);
    view.distance = distance;
    view.level = anchorLevel(model, chunk);
    // without a row of the embedding the appearance counts as zero, as in the fast version
    const std::vector<float> none(params.appearance_dim);
    view.appearance = model.embedding != nullptr && appearance >= 0
                          ? model.embedding + size_t(appearance) * params.appearance_dim
                          : none.data();
    std::vector<double> scratch(decodeScratch(params));
    const AnchorNetworks<double> anchor(model, view, chunk, local, scratch.data());
    anchor.evaluate(MlpKind::Opacity, anchor.opacity);
    anchor.evaluate(MlpKind::Covariance, anchor.covariance);
    anchor.evaluate(MlpKind::Color, anchor.color);

    std::vector<Drawn> drawn(params.n_offsets);
    for (uint32_t k = 0; k < params.n_offsets; ++k) {
        const double o = std::tanh(anchor.opacity[k]);
        drawn[k].opacity = o < double(kOpacityFloor) ? 0 : o;
        GaussianOf<double> g{};
        anchor.setShape(k, g);
        std::copy_n(g.color, 3, drawn[k].color);
        const double longest = std::max({0.0, g.scale[0], g.scale[1], g.scale[2]});
        double whitening[3]; // makes M^-1/2: fourth roots of the inverse, since covariance3() squares its argument
        for (int i = 0; i < 3; ++i)
            whitening[i] = 1 / std::sqrt(std::hypot(g.scale[i], kThinAxis * longest));
        spread(covariance3(g.scale, g.rotation), drawn[k].covariance);
        spread(covariance3(whitening, g.rotation), drawn[k].whitening);
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
        // Root of the mean square over the Gaussians that the probe looks at and that have an opacity. `tangents`:
        // factor by which the squares count.
        const auto rate = [&](const std::vector<Drawn>& after, double tangents) {
            double living = 0, squares = 0;
            for (size_t k = p % kOffsetStep; k < before.size(); k += kOffsetStep) {
                living += before[k].opacity != 0; // true also for NaN
                squares += tangents * squaredChange(before[k], after[k]);
            }
            return std::sqrt(squares / std::max(living, 1.0)) / kStep;
        };
        double turned[3];
        for (int i = 0; i < 3; ++i)
            turned[i] = probe.direction[i] + kStep * probe.tangent[i];
        direction = std::max(direction, rate(drawnAt(model, chunk, local, appearance, turned, probe.distance), 2));
        if (takesDistance(model))
            distance = std::max(
                distance,
                rate(drawnAt(model, chunk, local, appearance, probe.direction, probe.distance * (1 + kStep)), 1));
    }
}

} // namespace gsc
