// SPDX-License-Identifier: Apache-2.0
// How far pictures with foveation are from exact where an eye looks, and around that.
#pragma once

#include "runtime/metrics/picture_scorer.h"

#include <cstdint>
#include <string>

namespace gsc {

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
    // The two sides of a picture's fovea, inside first.
    void add(uint64_t frame, const FoveaSums (&sides)[2]);

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
