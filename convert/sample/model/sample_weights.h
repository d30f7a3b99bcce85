// SPDX-License-Identifier: Apache-2.0
// The MLPs of the sample models: as large as the trainers', with weights set by hand so that each feature has a
// meaning.
#pragma once

#include "convert/input/checkpoint.h"

#include <cstdint>
#include <vector>

namespace gsc {

constexpr uint32_t kSampleFeatures = 32;   // F, features per anchor
constexpr uint32_t kSampleOffsets = 10;    // K, Gaussians per anchor
constexpr uint32_t kSampleAppearance = 32; // columns of the appearance embedding, if the model has one

// First index of each kind of value in a feature vector, and how many there are. Colours are logits, because the colour
// MLP ends in a sigmoid.
constexpr uint32_t kFeatureBase = 0;  // 3 values: colour of the anchor
constexpr uint32_t kFeatureLight = 3; // K values: how much lighter Gaussian k is, in all channels
constexpr uint32_t kFeatureHue = 13;  // K values: how much bluer Gaussian k is, along kHueAxis
constexpr uint32_t kFeatureTurn = 23; // 3 values: rotation of the Gaussians, (x, y, z) / w of a quaternion
// 3 values: how much it mirrors towards x, y and z; negative = towards -x, -y, -z
constexpr uint32_t kFeatureGloss = 26;
constexpr uint32_t kFeatureAlive = 29;   // 1 value: share of the K Gaussians with an opacity above 0
constexpr uint32_t kFeatureOpacity = 30; // 1 value: added to the opacity before the tanh
constexpr uint32_t kFeatureRagged = 31;  // 1 value: how much orientation, size and opacity of the Gaussians vary

constexpr float kBaseLimit = 3.5f, kLightLimit = 2.5f, kHueLimit = 2.5f, kTurnLimit = 2.0f;
// change of red, green, blue; orthogonal to the change of lightness (1, 1, 1)
constexpr float kHueAxis[3] = {-1.0f, 0.1f, 0.9f};
constexpr float kSizeShare = 0.9f; // the covariance MLP multiplies exp(scale_3..5) by this

struct SampleInputs {
    bool feature_bank = false, bank_distance = false, bank_level = false;
    bool distance = false, level = false;
    uint32_t appearance = 0;
    float distance_unit = 1; // world units by which distances are divided
};

// In this order: opacity, covariance, colour, and the feature bank if the model has one. `water_glint`: view direction
// in which water mirrors the sun.
std::vector<Mlp> sampleMlps(const SampleInputs& inputs, const float water_glint[3]);
// Appearance embedding, rows x kSampleAppearance: each training photograph has the light of another hour.
std::vector<float> sampleEmbedding(uint32_t rows, uint64_t seed);

} // namespace gsc
