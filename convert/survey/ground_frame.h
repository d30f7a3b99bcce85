// SPDX-License-Identifier: Apache-2.0
// The ground that the anchors of a model lie on.
#pragma once

#include "convert/survey/camera_view.h"
#include "runtime/cameras/principal_axes.h"

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

namespace gsc {

constexpr double kHighestShare = 0.35; // share of the capture height above ground: roofs, masts and kites are higher
constexpr uint32_t kMinViews = 6;      // photographs that must show an anchor for it to be well seen

// Precondition of all: there are points, or values.
dvec3 meanOf(std::span<const dvec3> points);
// At most `most` of them, evenly.
template <typename T>
std::vector<T> everyNth(const std::vector<T>& all, size_t most)
{
    std::vector<T> some;
    const size_t step = std::max<size_t>(1, (all.size() + most - 1) / most);
    for (size_t i = 0; i < all.size(); i += step)
        some.push_back(all[i]);
    return some;
}

// Value below which a share of `q` lies; the order of `values` changes.
double quantile(std::vector<double>& values, double q);
double quantileAlong(std::span<const dvec3> points, dvec3 axis, double q);

// The ground of a model. Its height is the median of the points, the view height the median of the cameras above it.
struct GroundFrame {
    dvec3 axis[2]{}, up{};              // unit vectors, right-handed
    double ground = 0, view_height = 0; // along up
    double low[2] = {}, high[2] = {};   // 10 and 90 % of the points along the axes
};

// The plane is spanned by the two larger principal axes of the points; `up` is the third axis, turned to the side of
// the cameras, or to where the points' tail is longer if there are none.
GroundFrame fitGround(std::span<const dvec3> points, std::span<const SourceCamera> cameras);
// Fits as fitGround(), with a given up direction, a unit vector; ground lies at the `ground_share` quantile of the
// points.
GroundFrame fitGroundAlong(std::span<const dvec3> points, std::span<const SourceCamera> cameras, dvec3 up,
                           double ground_share);

// World units that stand for a metre of a viewer's body where nothing tells the scale: the eyes, 0.064 m apart, are
// 0.004 of the ground's side apart.
double metreOfGround(double side0, double side1);

} // namespace gsc
