// SPDX-License-Identifier: Apache-2.0
// View sensitivity: how fast what an anchor draws changes with the direction and the distance it is seen from. It
// decides how long an anchor may be drawn again as it was decoded (ReusePolicy::Error, design section 5).
//
// Per Gaussian of the anchor, E^2 = max over channels |d(o c)|^2 + opacity^2 |d o|^2 + scale^2 o^2 S^2 per unit of
// change, with o its opacity (0 below kOpacityFloor), c its colour and S = |M^-1/2 dM M^-1/2| / 2 the relative change of
// its covariance M; axes thinner than a tenth of the longest count as that long in M^-1/2. Directions: the root of the
// sum over two orthogonal tangents. Anchor: the root of the mean square over its living Gaussians, since a pixel sees
// many, and the largest over six probe directions, of networks that are piecewise smooth; a sample, not a bound.
// Measured on four trained models: with these weights and a bound of 1/255, 0.01 to 0.04 % of the pixels of a moving
// view are off by more than 1/255; the largest over the Gaussians instead asks for twice the decodes at equal error.
#pragma once

#include "kernels/common/buffer.h"
#include "kernels/decode/decode_body.h"

#include <cstdint>
#include <vector>

namespace gsc {

// What a change of opacity or of shape is worth beside one of premultiplied colour: the contrast, 0..1, between a
// Gaussian and what lies behind it.
struct SensitivityWeights {
    double opacity = 0.1;
    double scale = 0.1;
};
constexpr SensitivityWeights kSensitivityWeights;
constexpr double kThinAxis = 0.1; // of the longest axis

constexpr uint32_t kProbes = 6;        // directions an anchor is looked at from
constexpr uint32_t kProbeTangents = 3; // two of the direction, one of the logarithm of the distance

struct SensitivityProbe {
    double direction[3];  // unit, from the camera to the anchor
    double tangent[2][3]; // unit, orthogonal to it and to each other
    double distance;      // world units; what networks that take the distance are given
};

// The axes of a fixed frame, turned so that none is an axis of the scene. `distance` is sensitivityDistance(); the
// probes spread it by 3 to either side.
SensitivityProbe sensitivityProbe(uint32_t probe, double distance);

// Distance an anchor of this chunk is typically seen from: with levels the one its level is made for, else a quarter
// of the diagonal of ModelParams::bounds. 1 where neither is known.
double sensitivityDistance(const ModelView& model, uint32_t chunk);

// Whether some network takes the distance; where none does, distance sensitivities are 0.
bool takesDistance(const ModelView& model);

struct SensitivityScratch {
    Buffer<float> values;
};

// Sensitivities of the anchors [first, first + count) of a chunk. `direction`: per unit of change of the unit view
// direction; `distance`: per relative change of the distance; both in units of full scale (1, not 1/255), fp32, never
// NaN: infinite where an anchor decodes to values that are not numbers. `appearance`: row of the embedding, -1 = none.
// Reads of `model`: params, levels, chunks (level_index), arrays (feature, scale), weights, packed, embedding. One
// scratch per thread. There is a fixed cost of about one anchor's per call. The same bits on every machine with fused
// multiply-add (every x86 CPU since 2013, every 64-bit ARM).
void viewSensitivityCpu(const ModelView& model, uint32_t chunk, uint32_t first, uint32_t count, int32_t appearance,
                        float* direction, float* distance, SensitivityScratch& scratch);

// The change itself between two views, by the same measure and in double: the largest E over the anchor's Gaussians.
// Scalar; for tests and measurements.
double drawnChangeReference(const ModelView& model, uint32_t chunk, uint32_t local, int32_t appearance,
                            const double* direction0, double distance0, const double* direction1, double distance1,
                            const SensitivityWeights& weights = kSensitivityWeights);

// viewSensitivityCpu() for one anchor in double, by differences and with matrices instead of derivatives.
void viewSensitivityReference(const ModelView& model, uint32_t chunk, uint32_t local, int32_t appearance,
                              double& direction, double& distance);

} // namespace gsc
