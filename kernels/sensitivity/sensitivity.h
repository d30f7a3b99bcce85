// SPDX-License-Identifier: Apache-2.0
// View sensitivity: how fast the picture of an anchor changes with the direction and the distance from which it is
// seen. It decides how long an anchor may be drawn again without being decoded again (ReusePolicy::Error, design
// section 5).
//
// Per Gaussian of the anchor, E^2 = max over channels |d(o c)|^2 + opacity^2 |d o|^2 + scale^2 o^2 S^2 per unit of
// change, with o its opacity (0 below kOpacityFloor), c its colour and S = |M^-1/2 dM M^-1/2| / 2 the relative change
// of its covariance M; axes thinner than a tenth of the longest count as that long in M^-1/2. A probe looks from one
// direction and turns along one tangent; its E times sqrt(2) stands for the root of the sum over both, and opposite
// probes take orthogonal tangents. Three of the six probes look at a Gaussian, one of each opposite pair. The
// sensitivity at a probe is the root of the mean square over the Gaussians that it looks at and that have an opacity,
// since a pixel sees many; that of the anchor is the largest of its probes. The networks are piecewise smooth: this is
// a sample, not a bound.
//
// How far to sample was measured with tests/bench/bench_sensitivity when the largest Gaussian counted in place of the
// mean, with contrasts of 0.25, on six trained models, views of real cameras turned by one degree. Share of the anchors
// that change by no more than predicted, rank correlation of prediction and change:
//   both tangents, every Gaussian from all six   95 to 99 %   0.34 to 0.52
//   one tangent, all six                         95 to 99 %   0.26 to 0.52   2/3 of the time
//   one tangent, three of six                    93 to 98 %   0.28 to 0.50   2/5 of the time
#pragma once

#include "kernels/simd/buffer.h"
#include "kernels/decode/decode_body.h"

#include <cstdint>
#include <vector>

namespace gsc {

// Weights of a change of opacity and of a change of shape, where a change of premultiplied colour counts 1. They are
// the contrast, 0 to 1, between a Gaussian and its background.
struct SensitivityWeights {
    double opacity = 0.15;
    double scale = 0.15;
};
constexpr SensitivityWeights kSensitivityWeights;
constexpr double kThinAxis = 0.1; // an axis is thin if it is shorter than this share of the longest

constexpr uint32_t kProbes = 6;        // number of directions from which an anchor is looked at
constexpr uint32_t kOffsetStep = 2;    // probe p looks at the offsets k with k mod 2 = p mod 2; 1 would be all offsets
constexpr uint32_t kProbeTangents = 2; // one for the direction, one for the logarithm of the distance

struct SensitivityProbe {
    double direction[3]; // unit vector from the camera to the anchor
    double tangent[3];   // unit vector orthogonal to the direction
    double distance;     // distance, in world units, that is given to networks which take one
};

// Probe number `probe`: looks along an axis of a fixed frame, which is turned such that none of its axes is one of the
// scene. `distance` is sensitivityDistance(); probes look from a third of it, from it, and from three times it.
SensitivityProbe sensitivityProbe(uint32_t probe, double distance);

// Distance, in world units, from which an anchor of this chunk is typically seen: with levels the one for which its
// level is made, otherwise a quarter of the diagonal of ModelParams::bounds; 1 if neither is known.
double sensitivityDistance(const ModelView& model, uint32_t chunk);

// Returns true if some network takes the distance; otherwise the sensitivities to distance are 0.
bool takesDistance(const ModelView& model);

struct SensitivityScratch {
    Buffer<float> values;
};

// Computes the sensitivities of the anchors [first, first + count) of a chunk. `direction`: per unit of change of the
// unit view direction; `distance`: per relative change of the distance. Both are in units of full scale (1, not 1/255),
// fp32, never NaN; infinite if an anchor decodes to values that are not numbers. `appearance`: row of the embedding, -1
// = none. It reads from `model` params, levels, chunks (level_index), arrays (feature, scale), weights, packed and
// embedding. Each thread needs a scratch of its own. A call costs about as much as one anchor more. Results have equal
// bits on every machine with fused multiply-add (every x86 CPU since 2013, every 64-bit ARM).
void viewSensitivityCpu(const ModelView& model, uint32_t chunk, uint32_t first, uint32_t count, int32_t appearance,
                        float* direction, float* distance, SensitivityScratch& scratch);

// Change of an anchor's picture between two views, by the measure of the sensitivity and in double: the largest E over
// the anchor's Gaussians. Scalar; for tests and measurements.
double drawnChangeReference(const ModelView& model, uint32_t chunk, uint32_t local, int32_t appearance,
                            const double* direction0, double distance0, const double* direction1, double distance1,
                            const SensitivityWeights& weights = kSensitivityWeights);

// Scalar reference for viewSensitivityCpu(): one anchor, in double, by differences and matrices, without derivatives.
void viewSensitivityReference(const ModelView& model, uint32_t chunk, uint32_t local, int32_t appearance,
                              double& direction, double& distance);

} // namespace gsc
