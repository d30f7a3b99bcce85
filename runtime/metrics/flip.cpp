// SPDX-License-Identifier: Apache-2.0
// LDR-FLIP after Andersson, Nilsson, Akenine-Moeller, Oskarsson, Astrom and Fairchild, "FLIP: A Difference Evaluator
// for Alternating Images", Proc. ACM Comput. Graph. Interact. Tech. 3(2), 2020. Written from the paper's equations.
#include "runtime/metrics/metrics.h"

#include "runtime/metrics/convolve.h"

#include <glm/common.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

namespace gsc {

namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kColorExponent = 0.7;   // q_c
constexpr double kFeatureExponent = 0.5; // q_f
constexpr double kColorKnee = 0.4;       // p_c, of the largest colour difference
constexpr double kColorKneeValue = 0.95; // p_t
constexpr double kFeatureWidth = 0.082;  // degrees, w of the edge and point detectors

using Vec3 = glm::dvec3;

// Linear sRGB to CIE XYZ and back, D65; the white point is the image of (1, 1, 1), so that grey has no chroma.
const glm::dmat3 kToXyz = transpose(
    glm::dmat3(0.4124564, 0.3575761, 0.1804375, 0.2126729, 0.7151522, 0.0721750, 0.0193339, 0.1191920, 0.9503041));
const glm::dmat3 kFromXyz = inverse(kToXyz);
const Vec3 kWhite = kToXyz * Vec3(1);

double linearFromSrgb(double value)
{
    // written so that NaN becomes 0
    const double v = value > 0 ? std::min(value, 1.0) : 0.0;
    return v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4);
}

Vec3 yCxCz(const Vec3& linear)
{
    const Vec3 xyz = kToXyz * linear / kWhite;
    return {116 * xyz.y - 16, 500 * (xyz.x - xyz.y), 200 * (xyz.y - xyz.z)};
}

Vec3 linearFromYCxCz(const Vec3& color)
{
    const double y = (color.x + 16) / 116;
    return kFromXyz * (Vec3(color.y / 500 + y, y, y - color.z / 200) * kWhite);
}

// CIELAB whose chroma is scaled with lightness for the Hunt effect.
Vec3 huntLab(const Vec3& linear)
{
    constexpr double kDelta = 6.0 / 29.0;
    const auto f = [](double t) {
        return t > kDelta * kDelta * kDelta ? std::cbrt(t) : t / (3 * kDelta * kDelta) + 4.0 / 29.0;
    };
    const Vec3 xyz = kToXyz * linear / kWhite;
    const double fx = f(xyz.x), fy = f(xyz.y), fz = f(xyz.z);
    const double lightness = 116 * fy - 16;
    return {lightness, 0.01 * lightness * 500 * (fx - fy), 0.01 * lightness * 200 * (fy - fz)};
}

double hyAb(const Vec3& a, const Vec3& b)
{
    return std::abs(a.x - b.x) + std::hypot(a.y - b.y, a.z - b.z);
}

// Planes of the achromatic, red-green and blue-yellow channels.
struct Opponent {
    std::vector<float> plane[3];
};

Opponent opponentPlanes(const ImageView& image)
{
    Opponent out;
    const size_t pixels = size_t(image.width) * image.height;
    for (std::vector<float>& plane : out.plane)
        plane.resize(pixels);
    for (size_t i = 0; i < pixels; ++i) {
        const float* p = image.pixels + 3 * i;
        const Vec3 color =
            yCxCz({linearFromSrgb(double(p[0])), linearFromSrgb(double(p[1])), linearFromSrgb(double(p[2]))});
        for (int c = 0; c < 3; ++c)
            out.plane[c][i] = float(color[c]);
    }
    return out;
}

// Contrast sensitivity as one or two Gaussians a exp(-b f^2) over frequency, table 1 of the paper; in space each is
// a sqrt(pi / b) exp(-pi^2 d^2 / b), d in degrees. The sum is scaled to unit weight.
struct Sensitivity {
    double a[2], b[2];
};
constexpr Sensitivity kSensitivity[3] = {
    {{1.0, 0.0}, {0.0047, 1e-5}}, {{1.0, 0.0}, {0.0053, 1e-5}}, {{34.1, 13.5}, {0.04, 0.025}}};

void filterBySensitivity(const Sensitivity& sensitivity, const ImageView& size, double pixels_per_degree,
                         std::vector<float>& plane)
{
    constexpr double kWidestB = 0.04; // one radius for all three channels
    const int radius = int(std::ceil(3 * std::sqrt(kWidestB / (2 * kPi * kPi)) * pixels_per_degree));
    std::vector<double> kernel[2];
    double weight[2] = {}, total = 0;
    for (int term = 0; term < 2; ++term) {
        if (sensitivity.a[term] == 0)
            continue;
        double sum = 0;
        for (int i = -radius; i <= radius; ++i) {
            const double degrees = i / pixels_per_degree;
            kernel[term].push_back(std::exp(-kPi * kPi * degrees * degrees / sensitivity.b[term]));
            sum += kernel[term].back();
        }
        weight[term] = sensitivity.a[term] * std::sqrt(kPi / sensitivity.b[term]);
        total += weight[term] * sum * sum;
    }
    std::vector<float> result(plane.size()), part;
    for (int term = 0; term < 2; ++term) {
        if (kernel[term].empty())
            continue;
        filterPlane(plane, size.width, size.height, kernel[term], kernel[term], Border::Replicate, part);
        for (size_t i = 0; i < plane.size(); ++i)
            result[i] += float(weight[term] / total) * part[i];
    }
    plane = std::move(result);
}

// Redistribution of the colour difference: linear up to a knee, compressed above it.
double redistribute(double difference, double largest)
{
    const double knee = kColorKnee * largest;
    return difference < knee ? kColorKneeValue / knee * difference
                             : kColorKneeValue + (difference - knee) / (largest - knee) * (1 - kColorKneeValue);
}

std::vector<float> colorDifference(Opponent a, Opponent b, const ImageView& size, double pixels_per_degree)
{
    for (int c = 0; c < 3; ++c) {
        filterBySensitivity(kSensitivity[c], size, pixels_per_degree, a.plane[c]);
        filterBySensitivity(kSensitivity[c], size, pixels_per_degree, b.plane[c]);
    }
    const auto labOf = [](const Opponent& image, size_t i) {
        const Vec3 linear = linearFromYCxCz({image.plane[0][i], image.plane[1][i], image.plane[2][i]});
        return huntLab(glm::clamp(linear, 0.0, 1.0));
    };
    // green against blue is the largest difference the display can show
    const double largest = std::pow(hyAb(huntLab({0, 1, 0}), huntLab({0, 0, 1})), kColorExponent);
    std::vector<float> out(a.plane[0].size());
    for (size_t i = 0; i < out.size(); ++i)
        out[i] = float(redistribute(std::pow(hyAb(labOf(a, i), labOf(b, i)), kColorExponent), largest));
    return out;
}

// Strength of edges (first derivative of a Gaussian) and points (second derivative) in the achromatic plane.
struct Features {
    std::vector<float> edge, point;
};

Features featuresOf(const std::vector<float>& achromatic, const ImageView& size, double pixels_per_degree)
{
    const double sigma = 0.5 * kFeatureWidth * pixels_per_degree;
    const int radius = int(std::ceil(3 * sigma));
    std::vector<double> blur, first, second;
    for (int i = -radius; i <= radius; ++i) {
        const double g = std::exp(-i * i / (2 * sigma * sigma));
        blur.push_back(g);
        first.push_back(-i * g);
        second.push_back((i * i / (sigma * sigma) - 1) * g);
    }
    // positive weights sum to 1, negative ones to -1
    const auto normalise = [](std::vector<double>& kernel) {
        double positive = 0, negative = 0;
        for (const double weight : kernel)
            (weight > 0 ? positive : negative) += weight;
        for (double& weight : kernel)
            weight /= weight > 0 ? positive : -negative;
    };
    double total = 0;
    for (const double weight : blur)
        total += weight;
    for (double& weight : blur)
        weight /= total;
    normalise(first);
    normalise(second);

    std::vector<float> plane(achromatic.size());
    for (size_t i = 0; i < plane.size(); ++i)
        plane[i] = (achromatic[i] + 16) / 116;
    const auto magnitude = [&](const std::vector<double>& kernel, std::vector<float>& out) {
        std::vector<float> along_x, along_y;
        filterPlane(plane, size.width, size.height, kernel, blur, Border::Replicate, along_x);
        filterPlane(plane, size.width, size.height, blur, kernel, Border::Replicate, along_y);
        out.resize(plane.size());
        for (size_t i = 0; i < plane.size(); ++i)
            out[i] = std::hypot(along_x[i], along_y[i]);
    };
    Features out;
    magnitude(first, out.edge);
    magnitude(second, out.point);
    return out;
}

} // namespace

double flip(const ImageView& reference, const ImageView& test, double pixels_per_degree, std::span<float> map)
{
    const size_t pixels = size_t(reference.width) * reference.height;
    if (pixels == 0)
        return 0;
    Opponent a = opponentPlanes(reference), b = opponentPlanes(test);
    const Features fa = featuresOf(a.plane[0], reference, pixels_per_degree);
    const Features fb = featuresOf(b.plane[0], reference, pixels_per_degree);
    const std::vector<float> color = colorDifference(std::move(a), std::move(b), reference, pixels_per_degree);
    double sum = 0;
    for (size_t i = 0; i < pixels; ++i) {
        const double feature =
            std::max(std::abs(double(fa.edge[i]) - double(fb.edge[i])), std::abs(double(fa.point[i] - fb.point[i])));
        const double exponent = 1 - std::pow(std::min(1.0, feature / std::numbers::sqrt2), kFeatureExponent);
        const double error = std::pow(double(color[i]), exponent);
        if (!map.empty())
            map[i] = float(error);
        sum += error;
    }
    return sum / double(pixels);
}

} // namespace gsc
