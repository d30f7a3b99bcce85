// SPDX-License-Identifier: Apache-2.0
// How far pictures with foveation are from exact where an eye looks, and around that.
#pragma once

#include "kernels/frame/frame_types.h"
#include "runtime/metrics/metrics.h"

#include <cstdint>
#include <span>
#include <string>

namespace gsc {

// An eye and its gaze, right and down at depth 1.
struct EyeGaze {
    EyeParams eye{};
    float x = 0, y = 0;
};

// Is the middle of that pixel within 12 degrees of the gaze, where foveation draws everything (kFoveaInner)?
bool inFovea(const EyeGaze& gaze, uint32_t column, uint32_t row);

// PSNR is +inf where all pixels are equal.
struct FoveaAccuracy {
    struct Part {
        double share = 0; // of all pixels; 0 = the others mean nothing
        double psnr_pooled = 0, psnr_min = 0;
        uint64_t psnr_min_frame = 0;
        double flip = -1; // mean over pixels; -1 = not scored
    } inside, outside;
};

class FoveaScorer {
public:
    // `flip_map`: error of every pixel, empty where it is not known. Precondition: all of one size.
    void add(uint64_t frame, const ImageView& image, const ImageView& exact, const EyeGaze& gaze,
             std::span<const float> flip_map);

    [[nodiscard]] bool empty() const { return m_sums[0].pixels + m_sums[1].pixels == 0; }
    [[nodiscard]] FoveaAccuracy result() const;

private:
    struct Sums {
        uint64_t pixels = 0, flip_pixels = 0;
        double squares = 0, flip = 0;
        double psnr_min = 0; // of an image
        uint64_t psnr_min_frame = 0;
    };
    Sums m_sums[2]; // inside, outside
};

// One line.
std::string foveaText(const FoveaAccuracy& accuracy);

} // namespace gsc
