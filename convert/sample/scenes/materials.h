// SPDX-License-Identifier: Apache-2.0
// Looks of surfaces, averaged over the width of one Gaussian, so that no detail is finer than a Gaussian.
#pragma once

#include "convert/sample/scenes/scene.h"

namespace gsc {

struct MaterialSample {
    dvec3 reflectance{}; // linear
    dvec3 emission{};    // linear; light of its own, such as a reflected sky
    double gloss = 0;    // 0..1, how strongly it mirrors the sky at grazing angles
    double wrap = 0;     // light that passes round edges (leaves, fabric)
};

// `width` in metres. Terrain also moves the point to its height.
MaterialSample sampleMaterial(const SceneSpec& spec, const Surface& surface, SurfacePoint& point, double width);

// Colour of the sky in the direction `d`, display values.
dvec3 skyColor(dvec3 d, uint64_t seed);

// Box-filtered pattern that is one in [a, b) of every unit and zero elsewhere: mean over [x - w/2, x + w/2].
double pulse(double x, double a, double b, double w);
// Box-filtered pattern that is one in the single interval [a, b) and zero elsewhere: mean over [x - w/2, x + w/2].
double band(double x, double a, double b, double w);

// Interior of the room (materials_room.cpp).
MaterialSample sampleRoomMaterial(const Surface& surface, const SurfacePoint& point, double width);

} // namespace gsc
