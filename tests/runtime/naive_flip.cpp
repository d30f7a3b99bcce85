// SPDX-License-Identifier: Apache-2.0
#include "tests/runtime/naive_flip.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numbers>

namespace gsc::test {

namespace {

using Color = std::array<double, 3>;
using Plane = std::function<double(int x, int y)>;

constexpr double kPi = std::numbers::pi;
constexpr double kXyz[3][3] = {
    {0.4124564, 0.3575761, 0.1804375}, {0.2126729, 0.7151522, 0.0721750}, {0.0193339, 0.1191920, 0.9503041}};

Color toXyz(const Color& rgb)
{
    Color out{};
    for (size_t i = 0; i < 3; ++i)
        for (size_t j = 0; j < 3; ++j)
            out[i] += kXyz[i][j] * rgb[j];
    return out;
}

// Solves kXyz * rgb = xyz by Cramer's rule.
Color fromXyz(const Color& xyz)
{
    const auto det = [](const double m[3][3]) {
        return m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) - m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0]) +
               m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]);
    };
    Color out{};
    for (size_t column = 0; column < 3; ++column) {
        double m[3][3];
        for (size_t i = 0; i < 3; ++i)
            for (size_t j = 0; j < 3; ++j)
                m[i][j] = j == column ? xyz[i] : kXyz[i][j];
        out[column] = det(m) / det(kXyz);
    }
    return out;
}

Color relativeXyz(const Color& rgb)
{
    const Color white = toXyz({1, 1, 1}), xyz = toXyz(rgb);
    return {xyz[0] / white[0], xyz[1] / white[1], xyz[2] / white[2]};
}

Color opponent(const Color& rgb)
{
    const Color r = relativeXyz(rgb);
    return {116 * r[1] - 16, 500 * (r[0] - r[1]), 200 * (r[1] - r[2])};
}

Color fromOpponent(const Color& c)
{
    const Color white = toXyz({1, 1, 1});
    const double y = (c[0] + 16) / 116;
    return fromXyz({(y + c[1] / 500) * white[0], y * white[1], (y - c[2] / 200) * white[2]});
}

Color huntLab(const Color& rgb)
{
    const auto f = [](double t) { return t > 216.0 / 24389 ? std::cbrt(t) : (24389.0 / 27 * t + 16) / 116; };
    const Color r = relativeXyz(rgb);
    const double l = 116 * f(r[1]) - 16;
    return {l, 0.01 * l * 500 * (f(r[0]) - f(r[1])), 0.01 * l * 200 * (f(r[1]) - f(r[2]))};
}

double hyAb(const Color& a, const Color& b)
{
    return std::abs(a[0] - b[0]) + std::sqrt((a[1] - b[1]) * (a[1] - b[1]) + (a[2] - b[2]) * (a[2] - b[2]));
}

// Sum over a square window of weight(dx, dy) * plane, borders repeated.
double window(const Plane& plane, const ImageView& size, int x, int y, int radius,
              const std::function<double(int, int)>& weight)
{
    double sum = 0;
    for (int dy = -radius; dy <= radius; ++dy)
        for (int dx = -radius; dx <= radius; ++dx)
            sum += weight(dx, dy) *
                   plane(std::clamp(x + dx, 0, int(size.width) - 1), std::clamp(y + dy, 0, int(size.height) - 1));
    return sum;
}

double linear(double v)
{
    v = std::clamp(v, 0.0, 1.0);
    return v > 0.04045 ? std::pow((v + 0.055) / 1.055, 2.4) : v / 12.92;
}

Color linearPixel(const ImageView& image, int x, int y)
{
    const float* p = image.pixels + 3 * (size_t(y) * image.width + size_t(x));
    return {linear(double(p[0])), linear(double(p[1])), linear(double(p[2]))};
}

Color filteredLab(const ImageView& image, int x, int y, double ppd)
{
    constexpr double kA[3][2] = {{1, 0}, {1, 0}, {34.1, 13.5}};
    constexpr double kB[3][2] = {{0.0047, 1e-5}, {0.0053, 1e-5}, {0.04, 0.025}};
    const int radius = int(std::ceil(3 * std::sqrt(0.04 / (2 * kPi * kPi)) * ppd));
    Color filtered;
    for (size_t c = 0; c < 3; ++c) {
        const auto g = [&](int dx, int dy) {
            const double d2 = (dx * dx + dy * dy) / (ppd * ppd);
            double sum = 0;
            for (size_t k = 0; k < 2; ++k)
                sum += kA[c][k] * std::sqrt(kPi / kB[c][k]) * std::exp(-kPi * kPi * d2 / kB[c][k]);
            return sum;
        };
        const Plane one = [](int, int) { return 1.0; };
        const Plane channel = [&](int u, int v) { return opponent(linearPixel(image, u, v))[c]; };
        filtered[c] = window(channel, image, x, y, radius, g) / window(one, image, x, y, radius, g);
    }
    Color rgb = fromOpponent(filtered);
    for (double& v : rgb)
        v = std::clamp(v, 0.0, 1.0);
    return huntLab(rgb);
}

// Edge or point strength: the kernel's positive part sums to 1, its negative part to -1.
double feature(const ImageView& image, int x, int y, double ppd, bool point)
{
    const double sigma = 0.5 * 0.082 * ppd;
    const int radius = int(std::ceil(3 * sigma));
    const auto raw = [&](int along, int across) {
        const double g = std::exp(-(along * along + across * across) / (2 * sigma * sigma));
        return point ? (along * along / (sigma * sigma) - 1) * g : -along * g;
    };
    double positive = 0, negative = 0;
    for (int v = -radius; v <= radius; ++v)
        for (int u = -radius; u <= radius; ++u)
            (raw(u, v) > 0 ? positive : negative) += raw(u, v);
    const auto weight = [&](int along, int across) {
        const double w = raw(along, across);
        return w > 0 ? w / positive : -w / negative;
    };
    const Plane luma = [&](int u, int v) { return (opponent(linearPixel(image, u, v))[0] + 16) / 116; };
    const double gx = window(luma, image, x, y, radius, [&](int dx, int dy) { return weight(dx, dy); });
    const double gy = window(luma, image, x, y, radius, [&](int dx, int dy) { return weight(dy, dx); });
    return std::sqrt(gx * gx + gy * gy);
}

} // namespace

std::vector<double> naiveFlip(const ImageView& reference, const ImageView& test, double ppd)
{
    std::vector<double> out;
    const double largest = std::pow(hyAb(huntLab({0, 1, 0}), huntLab({0, 0, 1})), 0.7);
    for (int y = 0; y < int(reference.height); ++y)
        for (int x = 0; x < int(reference.width); ++x) {
            const double color = std::pow(hyAb(filteredLab(reference, x, y, ppd), filteredLab(test, x, y, ppd)), 0.7);
            const double shaped = color < 0.4 * largest
                                      ? 0.95 / (0.4 * largest) * color
                                      : 0.95 + 0.05 * (color - 0.4 * largest) / (largest - 0.4 * largest);
            const double edge = std::abs(feature(reference, x, y, ppd, false) - feature(test, x, y, ppd, false));
            const double point = std::abs(feature(reference, x, y, ppd, true) - feature(test, x, y, ppd, true));
            out.push_back(std::pow(shaped, 1 - std::sqrt(std::max(edge, point) / std::sqrt(2.0))));
        }
    return out;
}

} // namespace gsc::test
