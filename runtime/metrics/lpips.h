// SPDX-License-Identifier: Apache-2.0
// LPIPS (Zhang et al., "The Unreasonable Effectiveness of Deep Features as a Perceptual Metric", CVPR 2018), version 0.1
// with VGG16, as the evaluations of 3DGS, Scaffold-GS and Octree-GS call it: with pictures in [0, 1] as they are.
// note: LPIPS was trained on pictures scaled to [-1, 1], and its own code does that on request; none of the three asks
// for it, so numbers in their tables, and here, differ from what a picture scaled to [-1, 1] gets.
#pragma once

#include "runtime/metrics/metrics.h"

#include <array>
#include <functional>
#include <memory>
#include <vector>

namespace gsc {

// the output of the last ReLU of each stage is compared: relu1_2, 2_2, 3_3, 4_3, 5_3
constexpr uint32_t kLpipsStages = 5;
constexpr uint32_t kLpipsConvolutions = 13;
constexpr uint32_t kLpipsSmallest = 16; // smallest width and height in pixels, of which four halvings leave one

// A convolution of VGG16: 3x3 with a border of zeros. Every stage but the first begins with the maxima of 2x2 pixels.
struct LpipsConvolution {
    uint32_t stage;
    uint32_t feature; // number of the layer in torchvision's `features`
    uint32_t in, out; // number of input channels and of output channels
};
constexpr std::array<LpipsConvolution, kLpipsConvolutions> kLpipsNet = {{{0, 0, 3, 64},
                                                                         {0, 2, 64, 64},
                                                                         {1, 5, 64, 128},
                                                                         {1, 7, 128, 128},
                                                                         {2, 10, 128, 256},
                                                                         {2, 12, 256, 256},
                                                                         {2, 14, 256, 256},
                                                                         {3, 17, 256, 512},
                                                                         {3, 19, 512, 512},
                                                                         {3, 21, 512, 512},
                                                                         {4, 24, 512, 512},
                                                                         {4, 26, 512, 512},
                                                                         {4, 28, 512, 512}}};
// Output channels of each stage.
constexpr std::array<uint32_t, kLpipsStages> kLpipsChannels = {64, 128, 256, 512, 512};

struct LpipsWeights {
    std::array<std::vector<float>, kLpipsConvolutions> weight; // weights of each convolution, [out][in][3][3]
    std::array<std::vector<float>, kLpipsConvolutions> bias;   // biases of each convolution, [out]
    // weights of the channels in the distance, [channels] for each stage
    std::array<std::vector<float>, kLpipsStages> head;
};

struct LpipsDistance {
    double total = 0;                         // distance of the two pictures, the sum over the stages
    std::array<double, kLpipsStages> stage{}; // distance in each stage, a mean over the pixels
};

// Rows of features before they are scaled to unit length, for tests. Rows of pixels; the channels of a pixel lie side
// by side.
struct LpipsFeatures {
    uint32_t stage, image; // index of the stage; 0 for the first picture, 1 for the second
    uint32_t first_row, rows, width, channels;
    const float* values;
    size_t pixel_pitch, row_pitch; // distances from one pixel, and from one row, to the next, in floats
};
// function for tests, called by any thread once for each strip of rows
using LpipsObserver = std::function<void(const LpipsFeatures&)>;

class Lpips {
public:
    explicit Lpips(const LpipsWeights& weights, int threads = 0); // threads = 0 uses all cores
    ~Lpips();
    Lpips(const Lpips&) = delete;
    Lpips& operator=(const Lpips&) = delete;

    // Returns the distance of two pictures; NaN if a pixel is not finite. Does not depend on the number of threads.
    // Preconditions: equal sizes, kLpipsSmallest or more on each side.
    [[nodiscard]] LpipsDistance distance(const ImageView& a, const ImageView& b,
                                         const LpipsObserver& observer = {}) const;

private:
    struct Impl;
    std::unique_ptr<Impl> m_impl;
};

} // namespace gsc
