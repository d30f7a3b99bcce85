// SPDX-License-Identifier: Apache-2.0
// One frustum for two eyes, whatever their lenses and places are. Pure functions.
#pragma once

#include "kernels/select/bounds.h"
#include "runtime/camera.h"

#include <optional>

namespace gsc {

struct MergedView {
    Camera camera;     // place, axes and lens; no size
    double near_z = 0; // world units along its axis; nothing of either frustum is nearer
};

// The frustum that holds both eyes' frusta from `near_z` (the eyes' view units) on. Its apex lies as little behind the
// eyes as its sides allow: between parallel eyes with one lens, their distance / (2 tan(fov_x / 2)) behind the middle.
// None if no frustum below 180 degrees holds both, as for eyes that look apart; test each eye by itself then.
std::optional<MergedView> mergedView(const Camera& left, const Camera& right, double near_z);

// Do both eyes see every point at the same view z, but for what rounding makes of it? So do eyes that look the same way,
// neither ahead of the other, as in a headset without canted displays.
bool sameDepths(const EyeParams& left, const EyeParams& right);

// Half-spaces for rejectsBox() that hold for every anchor either eye sees, its size and the rasteriser's rounding
// included. Of the result only the planes are set: levels depend on each eye's own distance. None as above.
std::optional<EyeBounds> mergedBounds(const EyeParams& left, const EyeParams& right, const RasterConstants& rules);

} // namespace gsc
