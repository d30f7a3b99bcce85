// SPDX-License-Identifier: Apache-2.0
// The MLPs of the sample models: upstream's sizes, weights set by hand so that each feature has a meaning.
#pragma once

#include "convert/input/checkpoint.h"

#include <cstdint>
#include <vector>

namespace gsc {

constexpr uint32_t kSampleFeatures = 32;   // F
constexpr uint32_t kSampleOffsets = 10;    // K
constexpr uint32_t kSampleAppearance = 32; // A with everything on

// Meaning of each value of a feature vector. Colours are logits: the colour MLP ends in a sigmoid.
constexpr uint32_t kFeatureBase = 0;     // 3: colour of the anchor
constexpr uint32_t kFeatureLight = 3;    // K: Gaussian k is lighter (all channels)
constexpr uint32_t kFeatureHue = 13;     // K: Gaussian k is bluer (along kHueAxis)
constexpr uint32_t kFeatureTurn = 23;    // 3: rotation of the Gaussians, (x, y, z) / w of a quaternion
constexpr uint32_t kFeatureGloss = 26;   // 3: signed share of a mirror that faces along x, y, z
constexpr uint32_t kFeatureAlive = 29;   // share of the K Gaussians whose opacity is above zero
constexpr uint32_t kFeatureOpacity = 30; // added to the opacity before the tanh
constexpr uint32_t kFeatureRagged = 31;  // spread of orientation, size and opacity

constexpr float kBaseLimit = 3.5f, kLightLimit = 2.5f, kHueLimit = 2.5f, kTurnLimit = 2.0f;
constexpr float kHueAxis[3] = {-1.0f, 0.1f, 0.9f}; // orthogonal to the light axis (1, 1, 1)
constexpr float kSizeShare = 0.9f;                 // share of exp(scale_3..5) that the covariance MLP leaves

struct SampleInputs {
    bool feature_bank = false, bank_distance = false, bank_level = false;
    bool distance = false, level = false;
    uint32_t appearance = 0;
    float distance_unit = 1; // world units to which distances are compared
};

// opacity, covariance, colour, [feature bank]
std::vector<Mlp> sampleMlps(const SampleInputs& inputs, const float water_glint[3]);
// rows x kSampleAppearance: the light of the hour at which each training photograph was taken.
std::vector<float> sampleEmbedding(uint32_t rows, uint64_t seed);

} // namespace gsc
