// SPDX-License-Identifier: Apache-2.0
#include "runtime/metrics/filter_weights.h"

#include <cmath>
#include <numbers>

namespace gsc {

namespace {

constexpr double kPi = std::numbers::pi;
// width of FLIP's edge and point detectors (w in the paper), degrees of the view
constexpr double kFeatureWidth = 0.082;

// A Gaussian a exp(-b f^2) over the frequency f; in space it is a sqrt(pi / b) exp(-pi^2 d^2 / b), d in degrees.
struct Sensitivity {
    double a[2], b[2];
};
constexpr Sensitivity kSensitivity[3] = {
    {{1.0, 0.0}, {0.0047, 1e-5}}, {{1.0, 0.0}, {0.0053, 1e-5}}, {{34.1, 13.5}, {0.04, 0.025}}};

void normalise(std::vector<double>& kernel)
{
    double positive = 0, negative = 0;
    for (const double weight : kernel)
        (weight > 0 ? positive : negative) += weight;
    for (double& weight : kernel)
        weight /= weight > 0 ? positive : -negative;
}

} // namespace

std::vector<double> ssimWindow()
{
    constexpr int kRadius = 5;
    constexpr double kSigma = 1.5;
    std::vector<double> window;
    double total = 0;
    for (int i = -kRadius; i <= kRadius; ++i)
        total += window.emplace_back(std::exp(-i * i / (2 * kSigma * kSigma)));
    for (double& weight : window)
        weight /= total;
    return window;
}

std::vector<SensitivityTerm> sensitivityTerms(uint32_t channel, double pixels_per_degree)
{
    constexpr double kWidestB = 0.04; // the largest b of all channels, so that all kernels have one radius
    const int radius = int(std::ceil(3 * std::sqrt(kWidestB / (2 * kPi * kPi)) * pixels_per_degree));
    const Sensitivity& sensitivity = kSensitivity[channel];
    std::vector<SensitivityTerm> terms;
    std::vector<double> weights;
    double total = 0;
    for (int term = 0; term < 2; ++term) {
        if (sensitivity.a[term] == 0)
            continue;
        std::vector<double> kernel;
        double sum = 0;
        for (int i = -radius; i <= radius; ++i) {
            const double degrees = i / pixels_per_degree;
            kernel.push_back(std::exp(-kPi * kPi * degrees * degrees / sensitivity.b[term]));
            sum += kernel.back();
        }
        weights.push_back(sensitivity.a[term] * std::sqrt(kPi / sensitivity.b[term]));
        total += weights.back() * sum * sum;
        terms.push_back({std::move(kernel), 0});
    }
    for (size_t term = 0; term < terms.size(); ++term) // the weights of all terms together add up to 1
        terms[term].share = float(weights[term] / total);
    return terms;
}

FeatureFilters featureFilters(double pixels_per_degree)
{
    const double sigma = 0.5 * kFeatureWidth * pixels_per_degree;
    const int radius = int(std::ceil(3 * sigma));
    FeatureFilters filters;
    double total = 0;
    for (int i = -radius; i <= radius; ++i) {
        const double g = std::exp(-i * i / (2 * sigma * sigma));
        total += filters.blur.emplace_back(g);
        filters.first.push_back(-i * g);
        filters.second.push_back((i * i / (sigma * sigma) - 1) * g);
    }
    for (double& weight : filters.blur)
        weight /= total;
    normalise(filters.first);
    normalise(filters.second);
    return filters;
}

} // namespace gsc
