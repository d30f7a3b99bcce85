// SPDX-License-Identifier: Apache-2.0
#include "convert/sample/paths/ground_frame.h"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace gsc {

namespace {

constexpr double kNear = 0.2; // upstream's near plane

void setHeights(std::span<const Vec3> points, std::span<const PinholeView> views, double ground_share,
                GroundFrame& frame)
{
    for (int i = 0; i < 2; ++i) {
        frame.low[i] = quantileAlong(points, frame.axis[i], 0.1);
        frame.high[i] = quantileAlong(points, frame.axis[i], 0.9);
    }
    frame.ground = quantileAlong(points, frame.up, ground_share);
    std::vector<double> heights;
    for (const PinholeView& view : views)
        heights.push_back(dot(view.position, frame.up) - frame.ground);
    if (!heights.empty())
        frame.capture_height = quantile(heights, 0.5);
}

} // namespace

PinholeView pinholeView(const double position[3], const double rotation[9], double fx, double fy, double width,
                        double height)
{
    PinholeView view;
    view.position = {position[0], position[1], position[2]};
    std::memcpy(view.rotation, rotation, sizeof(view.rotation));
    view.fx = fx;
    view.fy = fy;
    view.width = width;
    view.height = height;
    return view;
}

bool sees(const PinholeView& c, Vec3 p)
{
    const double d[3] = {p.x - c.position.x, p.y - c.position.y, p.z - c.position.z};
    double view[3];
    for (int i = 0; i < 3; ++i)
        view[i] = c.rotation[i] * d[0] + c.rotation[3 + i] * d[1] + c.rotation[6 + i] * d[2];
    return view[2] > kNear && std::abs(view[0]) * c.fx <= view[2] * 0.5 * c.width &&
           std::abs(view[1]) * c.fy <= view[2] * 0.5 * c.height;
}

bool wellSeen(std::span<const PinholeView> views, uint32_t least, Vec3 p)
{
    uint32_t count = 0;
    for (const PinholeView& view : views)
        if (sees(view, p) && ++count >= least)
            return true;
    return least == 0;
}

// Jacobi rotations.
void principalAxes(double m[3][3], Vec3 axes[3], double values[3])
{
    double v[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    for (int sweep = 0; sweep < 32; ++sweep)
        for (int p = 0; p < 2; ++p)
            for (int q = p + 1; q < 3; ++q) {
                if (std::abs(m[p][q]) < 1e-300)
                    continue;
                const double theta = (m[q][q] - m[p][p]) / (2 * m[p][q]);
                const double t = (theta >= 0 ? 1 : -1) / (std::abs(theta) + std::sqrt(theta * theta + 1));
                const double c = 1 / std::sqrt(t * t + 1), s = t * c;
                for (int k = 0; k < 3; ++k) {
                    const double a = m[k][p], b = m[k][q];
                    m[k][p] = c * a - s * b;
                    m[k][q] = s * a + c * b;
                }
                for (int k = 0; k < 3; ++k) {
                    const double a = m[p][k], b = m[q][k];
                    m[p][k] = c * a - s * b;
                    m[q][k] = s * a + c * b;
                    const double e = v[k][p], f = v[k][q];
                    v[k][p] = c * e - s * f;
                    v[k][q] = s * e + c * f;
                }
            }
    int order[3] = {0, 1, 2};
    std::sort(order, order + 3, [&](int a, int b) { return m[a][a] > m[b][b]; });
    for (int i = 0; i < 3; ++i) {
        const Vec3 axis{v[0][order[i]], v[1][order[i]], v[2][order[i]]};
        // a sign that does not depend on the path of the iteration
        const double largest = std::max({axis.x, axis.y, axis.z}), smallest = std::min({axis.x, axis.y, axis.z});
        axes[i] = axis * (largest >= -smallest ? 1.0 : -1.0);
        values[i] = m[order[i]][order[i]];
    }
}

Vec3 principalAxesOf(std::span<const Vec3> points, Vec3 axes[3], double values[3])
{
    Vec3 mean;
    for (const Vec3& p : points)
        mean = mean + p * (1.0 / double(points.size()));
    double m[3][3] = {};
    for (const Vec3& p : points) {
        const double d[3] = {p.x - mean.x, p.y - mean.y, p.z - mean.z};
        for (int i = 0; i < 3; ++i)
            for (int j = 0; j < 3; ++j)
                m[i][j] += d[i] * d[j];
    }
    principalAxes(m, axes, values);
    return mean;
}

double quantile(std::vector<double>& values, double q)
{
    const auto at = values.begin() + std::ptrdiff_t(q * double(values.size() - 1) + 0.5);
    std::nth_element(values.begin(), at, values.end());
    return *at;
}

double quantileAlong(std::span<const Vec3> points, Vec3 axis, double q)
{
    std::vector<double> values(points.size());
    for (size_t i = 0; i < points.size(); ++i)
        values[i] = dot(points[i], axis);
    return quantile(values, q);
}

GroundFrame fitGround(std::span<const Vec3> points, std::span<const PinholeView> views)
{
    GroundFrame frame;
    Vec3 axes[3];
    double values[3];
    const Vec3 mean = principalAxesOf(points, axes, values);
    double side;
    if (views.empty()) {
        side = dot(mean, axes[2]) - quantileAlong(points, axes[2], 0.5);
    } else {
        Vec3 eye;
        for (const PinholeView& view : views)
            eye = eye + view.position * (1.0 / double(views.size()));
        side = dot(eye - mean, axes[2]);
    }
    frame.up = axes[2] * (side >= 0 ? 1.0 : -1.0);
    frame.axis[0] = axes[0];
    frame.axis[1] = cross(frame.up, axes[0]);
    setHeights(points, views, 0.5, frame);
    return frame;
}

GroundFrame fitGroundAlong(std::span<const Vec3> points, std::span<const PinholeView> views, Vec3 up,
                           double ground_share)
{
    std::vector<Vec3> flat(points.begin(), points.end());
    for (Vec3& p : flat)
        p = p - up * dot(p, up);
    Vec3 axes[3];
    double values[3];
    principalAxesOf(flat, axes, values);
    GroundFrame frame;
    frame.up = up;
    frame.axis[0] = normalized(axes[0] - up * dot(axes[0], up));
    frame.axis[1] = cross(up, frame.axis[0]);
    setHeights(points, views, ground_share, frame);
    return frame;
}

double metreOfGround(double side0, double side1)
{
    return 0.004 * std::sqrt(side0 * side1) / 0.064;
}

} // namespace gsc
