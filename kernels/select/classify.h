// SPDX-License-Identifier: Apache-2.0
// A quick look at a group's anchors that settles most of them; the rest take the exact test.
#pragma once

#include "kernels/select/bounds.h"

namespace gsc {

// Values of a group's anchors that classifyGroup() reads, gathered once for both eyes.
struct GroupLanes {
    alignas(64) float x[kGroupSize];
    alignas(64) float y[kGroupSize];
    alignas(64) float z[kGroupSize];
    alignas(64) float log_sigma[kGroupSize]; // largest of scale_0..2, NaN if any is
    alignas(64) float extra_level[kGroupSize];
    uint32_t count;
};

struct EyeClassifier {
    EyeBounds bounds;
    BoundPlane inside[4]; // a point with positive values projects into the image, if it lies in front
    float depth[4];       // row of the view matrix that gives view z
    float depth_min, depth_max;
    float sigma_slope; // largest sigma / z for which no determinant can round to zero
    bool usable;       // false: every anchor takes the exact test
};

// Rounding of the quick arithmetic stays below these.
constexpr float kPlaneSlack = 1e-5f; // error of a sum, in magnitudes of its summands
constexpr float kLodSlack = 3e-3f;   // error of ln(distance)

struct LodClassifier {
    bool by_distance;   // else kept at any distance
    float shift;        // lodShift() of the level
    float limit, slope; // kept iff ln(distance) <= limit + slope * extra_level, up to kLodSlack; limit: -inf = never
};

EyeClassifier eyeClassifier(const ModelParams& params, const EyeParams& eye, const RasterConstants& rules,
                            float lod_bias, float lod_fade);
LodClassifier lodClassifier(const ModelParams& params, int32_t level, float lod_bias, float lod_fade);

struct Classes {
    uint64_t hidden[kGroupSize / 64];  // testAnchor() is false
    uint64_t visible[kGroupSize / 64]; // testAnchor() is true
};

// lanes.* beyond count, up to the next multiple of 16, must be readable.
void classifyGroup(const EyeClassifier& eye, const LodClassifier& lod, const GroupLanes& lanes, Classes& classes);

} // namespace gsc
