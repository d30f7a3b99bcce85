// SPDX-License-Identifier: Apache-2.0
#include "convert/survey/ground_frame.h"

#include <glm/matrix.hpp>

#include <algorithm>
#include <cmath>

namespace gsc {

namespace {

void setHeights(std::span<const dvec3> points, std::span<const SourceCamera> cameras, double ground_share,
                GroundFrame& frame)
{
    for (int i = 0; i < 2; ++i) {
        frame.low[i] = quantileAlong(points, frame.axis[i], 0.1);
        frame.high[i] = quantileAlong(points, frame.axis[i], 0.9);
    }
    frame.ground = quantileAlong(points, frame.up, ground_share);
    std::vector<double> heights;
    for (const SourceCamera& camera : cameras)
        heights.push_back(dot(eyeOf(camera), frame.up) - frame.ground);
    if (!heights.empty())
        frame.view_height = quantile(heights, 0.5);
}

// Principal axes of how the points scatter about their mean.
PrincipalAxes axesOf(std::span<const dvec3> points)
{
    const dvec3 mean = meanOf(points);
    glm::dmat3 scatter(0);
    for (const dvec3& p : points)
        scatter += outerProduct(p - mean, p - mean);
    return principalAxes(scatter);
}

} // namespace

dvec3 meanOf(std::span<const dvec3> points)
{
    dvec3 mean{};
    for (const dvec3& p : points)
        mean += p * (1.0 / double(points.size()));
    return mean;
}

double quantile(std::vector<double>& values, double q)
{
    const auto at = values.begin() + std::ptrdiff_t(q * double(values.size() - 1) + 0.5);
    std::nth_element(values.begin(), at, values.end());
    return *at;
}

double quantileAlong(std::span<const dvec3> points, dvec3 axis, double q)
{
    std::vector<double> values(points.size());
    for (size_t i = 0; i < points.size(); ++i)
        values[i] = dot(points[i], axis);
    return quantile(values, q);
}

GroundFrame fitGround(std::span<const dvec3> points, std::span<const SourceCamera> cameras)
{
    GroundFrame frame;
    const PrincipalAxes found = axesOf(points);
    const dvec3 *const axes = found.axes, mean = meanOf(points);
    double side;
    if (cameras.empty()) {
        side = dot(mean, axes[2]) - quantileAlong(points, axes[2], 0.5);
    } else {
        std::vector<dvec3> eyes;
        for (const SourceCamera& camera : cameras)
            eyes.push_back(eyeOf(camera));
        side = dot(meanOf(eyes) - mean, axes[2]);
    }
    frame.up = axes[2] * (side >= 0 ? 1.0 : -1.0);
    frame.axis[0] = axes[0];
    frame.axis[1] = cross(frame.up, axes[0]);
    setHeights(points, cameras, 0.5, frame);
    return frame;
}

GroundFrame fitGroundAlong(std::span<const dvec3> points, std::span<const SourceCamera> cameras, dvec3 up,
                           double ground_share)
{
    std::vector<dvec3> flat(points.begin(), points.end());
    for (dvec3& p : flat)
        p = p - up * dot(p, up);
    const dvec3 longest = axesOf(flat).axes[0];
    GroundFrame frame;
    frame.up = up;
    frame.axis[0] = normalized(longest - up * dot(longest, up));
    frame.axis[1] = cross(up, frame.axis[0]);
    setHeights(points, cameras, ground_share, frame);
    return frame;
}

double metreOfGround(double side0, double side1)
{
    return 0.004 * std::sqrt(side0 * side1) / 0.064;
}

} // namespace gsc
