// SPDX-License-Identifier: Apache-2.0
// LDR-FLIP on a CPU. kernels/metrics/flip_rules.h has the arithmetic of a pixel, and names its authors.
#include "runtime/metrics/metrics.h"

#include "kernels/metrics/flip_rules.h"
#include "runtime/metrics/convolve.h"
#include "runtime/metrics/filter_weights.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace gsc {

namespace {

// Planes of the achromatic, the red-green and the blue-yellow channel.
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
        const Vec3d color = opponentOf(image.pixels + 3 * i);
        out.plane[0][i] = float(color.x);
        out.plane[1][i] = float(color.y);
        out.plane[2][i] = float(color.z);
    }
    return out;
}

void filterBySensitivity(uint32_t channel, const ImageView& size, double pixels_per_degree, std::vector<float>& plane)
{
    std::vector<float> result(plane.size()), part;
    for (const SensitivityTerm& term : sensitivityTerms(channel, pixels_per_degree)) {
        filterPlane(plane, size.width, size.height, term.kernel, term.kernel, Border::Replicate, part);
        for (size_t i = 0; i < plane.size(); ++i)
            result[i] += term.share * part[i];
    }
    plane = std::move(result);
}

std::vector<float> colorDifference(Opponent a, Opponent b, const ImageView& size, double pixels_per_degree)
{
    for (uint32_t c = 0; c < 3; ++c) {
        filterBySensitivity(c, size, pixels_per_degree, a.plane[c]);
        filterBySensitivity(c, size, pixels_per_degree, b.plane[c]);
    }
    const auto labOf = [](const Opponent& image, size_t i) {
        return huntLabOfOpponent(image.plane[0][i], image.plane[1][i], image.plane[2][i]);
    };
    const double largest = largestFlipColor();
    std::vector<float> out(a.plane[0].size());
    for (size_t i = 0; i < out.size(); ++i)
        out[i] = float(flipColorError(labOf(a, i), labOf(b, i), largest));
    return out;
}

std::vector<FlipFeatures> featuresOf(const std::vector<float>& achromatic, const ImageView& size,
                                     double pixels_per_degree)
{
    const FeatureFilters filters = featureFilters(pixels_per_degree);
    std::vector<float> plane(achromatic.size());
    for (size_t i = 0; i < plane.size(); ++i)
        plane[i] = (achromatic[i] + 16) / 116;
    std::vector<FlipFeatures> out(plane.size());
    const auto detect = [&](const std::vector<double>& kernel, float FlipFeatures::*strength) {
        std::vector<float> along_x, along_y;
        filterPlane(plane, size.width, size.height, kernel, filters.blur, Border::Replicate, along_x);
        filterPlane(plane, size.width, size.height, filters.blur, kernel, Border::Replicate, along_y);
        for (size_t i = 0; i < plane.size(); ++i)
            out[i].*strength = std::hypot(along_x[i], along_y[i]);
    };
    detect(filters.first, &FlipFeatures::edge);
    detect(filters.second, &FlipFeatures::point);
    return out;
}

} // namespace

double flip(const ImageView& reference, const ImageView& test, double pixels_per_degree, std::span<float> map)
{
    const size_t pixels = size_t(reference.width) * reference.height;
    if (pixels == 0)
        return 0;
    Opponent a = opponentPlanes(reference), b = opponentPlanes(test);
    const std::vector<FlipFeatures> fa = featuresOf(a.plane[0], reference, pixels_per_degree);
    const std::vector<FlipFeatures> fb = featuresOf(b.plane[0], reference, pixels_per_degree);
    const std::vector<float> color = colorDifference(std::move(a), std::move(b), reference, pixels_per_degree);
    double sum = 0;
    for (size_t i = 0; i < pixels; ++i) {
        const double error = flipPixel(color[i], fa[i], fb[i]);
        if (!map.empty())
            map[i] = float(error);
        sum += error;
    }
    return sum / double(pixels);
}

} // namespace gsc
