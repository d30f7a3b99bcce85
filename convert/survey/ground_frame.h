// SPDX-License-Identifier: Apache-2.0
// Finds the ground on which the anchors of a model lie.
#pragma once

#include "convert/survey/camera_view.h"
#include "runtime/cameras/principal_axes.h"

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

namespace gsc {

// share of the height of the cameras above the ground; roofs, masts and kites are higher
constexpr double kHighestShare = 0.35;
constexpr uint32_t kMinViews = 6; // number of photographs that must show an anchor so that it counts as well seen

// Mean of the points. Precondition of this and the following functions: there is at least one point or value.
dvec3 meanOf(std::span<const dvec3> points);
// At most `most` of the elements, evenly spaced.
template <typename T>
std::vector<T> everyNth(const std::vector<T>& all, size_t most)
{
    std::vector<T> some;
    const size_t step = std::max<size_t>(1, (all.size() + most - 1) / most);
    for (size_t i = 0; i < all.size(); i += step)
        some.push_back(all[i]);
    return some;
}

// Value below which the share `q`, 0 to 1, of the values lies. The order of `values` changes.
double quantile(std::vector<double>& values, double q);
double quantileAlong(std::span<const dvec3> points, dvec3 axis, double q);

// The ground of a model. Its height is the median of the points; view_height is the median height of the cameras above
// it.
struct GroundFrame {
    // unit vectors that form a right-handed system
    dvec3 axis[2]{}, up{};
    double ground = 0, view_height = 0; // world units along `up`
    double low[2] = {}, high[2] = {};   // between these lie the points from 10 to 90 %, along each axis
};

// Fits a plane through the two larger principal axes of the points. `up` is the third axis, towards the cameras, or
// without cameras towards the side on which points lie farther away.
GroundFrame fitGround(std::span<const dvec3> points, std::span<const SourceCamera> cameras);
// Fits as fitGround(), but with `up`, a unit vector, given. The ground lies at the quantile `ground_share`, 0 to 1, of
// the points along it.
GroundFrame fitGroundAlong(std::span<const dvec3> points, std::span<const SourceCamera> cameras, dvec3 up,
                           double ground_share);

// World units to a metre if nothing else tells the scale: such that the eyes, 0.064 m apart, are 0.004 of the ground's
// side apart.
double metreOfGround(double side0, double side1);

} // namespace gsc
