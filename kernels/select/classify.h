// SPDX-License-Identifier: Apache-2.0
// Quick test of a group's anchors that decides about most of them; the others need the exact test.
#pragma once

#include "kernels/select/bounds.h"

namespace gsc {

// Values of a group's anchors that classifyGroup() reads, gathered once for both eyes.
struct GroupLanes {
    alignas(64) float x[kGroupSize];
    alignas(64) float y[kGroupSize];
    alignas(64) float z[kGroupSize];
    alignas(64) float log_sigma[kGroupSize]; // largest of the logarithmic scale[0..2], NaN if one of them is NaN
    alignas(64) float extra_level[kGroupSize];
    uint32_t count;
};

struct EyeClassifier {
    EyeBounds bounds;
    // planes: a point with positive values at all of them projects into the image, if it lies in front of the eye
    BoundPlane inside[4];
    float depth[4]; // row of the view matrix that gives view z
    float depth_min, depth_max;
    float sigma_slope; // largest sigma / z for which no determinant can round to zero
    bool usable;       // false: every anchor needs the exact test
};

// Bounds of the rounding errors of the quick test.
constexpr float kPlaneSlack = 1e-5f; // largest error of a sum, relative to the magnitudes of its terms
constexpr float kLodSlack = 3e-3f;   // largest error of ln(distance)

struct LodClassifier {
    bool by_distance; // false: anchors are kept at any distance
    float shift;      // lodShift() of the level, world units
    // an anchor is kept if ln(distance) <= limit + slope * extra_level, up to kLodSlack; limit: -inf = never
    float limit, slope;
};

EyeClassifier eyeClassifier(const ModelParams& params, const EyeParams& eye, const RasterConstants& rules,
                            float lod_bias, float lod_fade);
LodClassifier lodClassifier(const ModelParams& params, int32_t level, float lod_bias, float lod_fade);

struct Classes {
    uint64_t hidden[kGroupSize / 64];  // a bit for each anchor: testAnchor() is false
    uint64_t visible[kGroupSize / 64]; // a bit for each anchor: testAnchor() is true
};

// Classifies the anchors of a group. Elements of `lanes` beyond `count`, up to a multiple of 16, must be readable.
void classifyGroup(const EyeClassifier& eye, const LodClassifier& lod, const GroupLanes& lanes, Classes& classes);

} // namespace gsc
