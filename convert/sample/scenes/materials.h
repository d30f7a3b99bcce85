// SPDX-License-Identifier: Apache-2.0
// Colours of surfaces, averaged over the width of one Gaussian, so that no detail is finer than a Gaussian.
#pragma once

#include "convert/sample/scenes/scene.h"

namespace gsc {

struct MaterialSample {
    dvec3 reflectance{}; // linear, 0 to 1
    dvec3 emission{};    // linear; light that does not depend on the scene's light, such as a mirrored sky
    double gloss = 0;    // 0 to 1: how strongly it mirrors the sky at grazing angles
    double wrap = 0;     // 0 to 1: how far light reaches round edges (leaves, fabric)
};

// Look of a surface at a point. `width`: metres to average over. Terrain also moves the point to its height.
MaterialSample sampleMaterial(const SceneSpec& spec, const Surface& surface, SurfacePoint& point, double width);

// Colour of the sky in direction `d`, as display values.
dvec3 skyColor(dvec3 d, uint64_t seed);

// Pattern that is 1 in [n + a, n + b) for every integer n, else 0; averaged over [x - w/2, x + w/2].
double pulse(double x, double a, double b, double w);
// Pattern that is 1 in the interval [a, b), else 0; averaged over [x - w/2, x + w/2].
double band(double x, double a, double b, double w);

// Look of a surface of the room's interior (materials_room.cpp).
MaterialSample sampleRoomMaterial(const Surface& surface, const SurfacePoint& point, double width);

} // namespace gsc
