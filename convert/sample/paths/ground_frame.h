// SPDX-License-Identifier: Apache-2.0
// Which anchors the photographs cover well, and the ground they lie on.
#pragma once

#include "convert/sample/vec3.h"

#include <cstdint>
#include <span>
#include <vector>

namespace gsc {

// A photograph's view: what `sees` needs of a camera.
struct PinholeView {
    Vec3 position;
    double rotation[9] = {};                      // row-major camera-to-world; columns are right, down, forward
    double fx = 0, fy = 0, width = 0, height = 0; // pixels

    [[nodiscard]] Vec3 column(int i) const { return {rotation[i], rotation[3 + i], rotation[6 + i]}; }
    [[nodiscard]] Vec3 forward() const { return column(2); }
};

PinholeView pinholeView(const double position[3], const double rotation[9], double fx, double fy, double width,
                        double height);

// True if `p` projects into the image. Upstream's near plane, 0.2 world units, is the nearest it may lie.
bool sees(const PinholeView& view, Vec3 p);
// True if at least `least` of the views see `p`.
bool wellSeen(std::span<const PinholeView> views, uint32_t least, Vec3 p);

constexpr double kHighestShare = 0.35; // of the capture height, above ground: roofs, masts and kites are higher
constexpr uint32_t kMinViews = 6;      // a well-seen anchor is in at least as many photographs

// Eigenvectors and eigenvalues of a symmetric matrix, the largest first; m is used up. The signs do not depend on the
// path of the iteration.
void principalAxes(double m[3][3], Vec3 axes[3], double values[3]);
// The same of the points' scatter about their mean, which is returned. Precondition: there are points.
Vec3 principalAxesOf(std::span<const Vec3> points, Vec3 axes[3], double values[3]);

// Value below which a share of `q` lies; the order of `values` changes. Precondition: there are values.
double quantile(std::vector<double>& values, double q);
double quantileAlong(std::span<const Vec3> points, Vec3 axis, double q);

// The ground of a model. Its height is the median of the points, the capture height the median of the views above it.
struct GroundFrame {
    Vec3 axis[2], up;                      // unit vectors, right-handed
    double ground = 0, capture_height = 0; // along up
    double low[2] = {}, high[2] = {};      // 10 and 90 % of the points along the axes
};

// The plane is spanned by the two larger principal axes of the points; `up` is the third axis, turned to the side of
// the views, or to where the points' tail is longer if there are none.
GroundFrame fitGround(std::span<const Vec3> points, std::span<const PinholeView> views);
// The same with a given up direction, a unit vector; ground lies at the `ground_share` quantile of the points.
GroundFrame fitGroundAlong(std::span<const Vec3> points, std::span<const PinholeView> views, Vec3 up,
                           double ground_share);

// World units that stand for a metre of a viewer's body where nothing tells the scale: the eyes, 0.064 m apart, are
// 0.004 of the ground's side apart.
double metreOfGround(double side0, double side1);

} // namespace gsc
