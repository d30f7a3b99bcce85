// SPDX-License-Identifier: Apache-2.0
// Weights and pictures that tests/runtime/lpips_reference.py makes too, bit for bit, so that no weights need to be stored.
#pragma once

#include "runtime/metrics/lpips.h"

#include <cmath>
#include <cstdint>
#include <vector>

namespace gsc::test {

// In [-1, 1), a multiple of 2^-23, which a float holds.
inline float lpipsNoise(uint32_t stream, uint32_t i)
{
    uint32_t x = i * 2654435761u + stream * 0x9e3779b9u;
    x = (x ^ x >> 16) * 0x7feb352du;
    x = (x ^ x >> 15) * 0x846ca68bu;
    x ^= x >> 16;
    return float(x >> 8) * 0x1p-23f - 1;
}

inline LpipsWeights lpipsRandomWeights()
{
    LpipsWeights weights;
    for (uint32_t n = 0; n < kLpipsConvolutions; ++n) {
        const LpipsConvolution& convolution = kLpipsNet[n];
        const float bound = float(std::sqrt(6.0 / (9 * convolution.in))); // keeps the size of what passes
        weights.weight[n].resize(size_t(9) * convolution.in * convolution.out);
        for (uint32_t i = 0; i < weights.weight[n].size(); ++i)
            weights.weight[n][i] = lpipsNoise(n, i) * bound;
        weights.bias[n].resize(convolution.out);
        for (uint32_t i = 0; i < convolution.out; ++i)
            weights.bias[n][i] = lpipsNoise(20 + n, i) * 0.1f;
    }
    for (uint32_t stage = 0; stage < kLpipsStages; ++stage) {
        weights.head[stage].resize(kLpipsChannels[stage]);
        for (uint32_t i = 0; i < kLpipsChannels[stage]; ++i)
            weights.head[stage][i] = (lpipsNoise(40 + stage, i) + 1) * float(0.5 / kLpipsChannels[stage]);
    }
    return weights;
}

// Image 1 is image 0 with a quarter of noise.
inline std::vector<float> lpipsRandomPicture(uint32_t image, uint32_t width, uint32_t height)
{
    std::vector<float> pixels(size_t(3) * width * height);
    for (uint32_t i = 0; i < pixels.size(); ++i) {
        pixels[i] = (lpipsNoise(60, i) + 1) * 0.5f;
        if (image == 1)
            pixels[i] = pixels[i] * 0.75f + (lpipsNoise(61, i) + 1) * 0.125f;
    }
    return pixels;
}

} // namespace gsc::test
