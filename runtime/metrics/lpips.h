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

constexpr uint32_t kLpipsStages = 5; // each ends in a ReLU whose output is compared: relu1_2, 2_2, 3_3, 4_3, 5_3
constexpr uint32_t kLpipsConvolutions = 13;
constexpr uint32_t kLpipsSmallest = 16; // pixels of a side, of which four poolings leave one

// The convolutions of VGG16, all 3x3 with a border of zeros; each but the first stage starts with a 2x2 maximum.
struct LpipsConvolution {
    uint32_t stage;
    uint32_t feature; // number in torchvision's `features`
    uint32_t in, out; // channels
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
// channels at the end of each stage
constexpr std::array<uint32_t, kLpipsStages> kLpipsChannels = {64, 128, 256, 512, 512};

struct LpipsWeights {
    std::array<std::vector<float>, kLpipsConvolutions> weight; // [out][in][3][3]
    std::array<std::vector<float>, kLpipsConvolutions> bias;   // [out]
    std::array<std::vector<float>, kLpipsStages> head;         // [channels]
};

struct LpipsDistance {
    double total = 0;                         // the sum of the stages
    std::array<double, kLpipsStages> stage{}; // means over pixels
};

// Rows of features before they are scaled to unit length: row-major pixels, channels together.
struct LpipsFeatures {
    uint32_t stage, image; // image 0 or 1
    uint32_t first_row, rows, width, channels;
    const float* values;
    size_t pixel_pitch, row_pitch; // floats
};
using LpipsObserver = std::function<void(const LpipsFeatures&)>; // called by any thread, once for each row

class Lpips {
public:
    explicit Lpips(const LpipsWeights& weights, int threads = 0); // 0 = all cores
    ~Lpips();
    Lpips(const Lpips&) = delete;
    Lpips& operator=(const Lpips&) = delete;

    // NaN if a pixel is not finite. Does not depend on the number of threads.
    // Preconditions: equal sizes, kLpipsSmallest or more on each side.
    [[nodiscard]] LpipsDistance distance(const ImageView& a, const ImageView& b,
                                         const LpipsObserver& observer = {}) const;

private:
    struct Impl;
    std::unique_ptr<Impl> m_impl;
};

} // namespace gsc
