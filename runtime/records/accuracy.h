// SPDX-License-Identifier: Apache-2.0
// How far the images of a run are from the exact ones of the same poses, over all of its frames.
#pragma once

#include "runtime/records/score_options.h"

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace gsc {

// Values that stand for an image with a pixel that is not finite, for which JSON has no word.
constexpr double kBrokenPsnr = -999, kWorstError = 1e30;

inline double boundedPsnr(double psnr)
{
    return psnr > kBrokenPsnr ? psnr : kBrokenPsnr;
}

// How far pictures with foveation are from exact where an eye looks, and around that. PSNR is +inf where all pixels are equal.
struct FoveaAccuracy {
    struct Part {
        double share = 0; // of all pixels; 0 = the others mean nothing
        double psnr_pooled = 0, psnr_min = 0;
        uint64_t psnr_min_frame = 0;
        double flip = -1; // mean over pixels; -1 = not scored
    } inside, outside;
};

// One line.
std::string foveaText(const FoveaAccuracy& accuracy);

// Every eye of every scored frame is an image. PSNR is +inf for equal images.
struct Accuracy {
    uint64_t images = 0;
    ScoredFrames scored;
    double psnr_pooled = 0, psnr_p1 = 0, psnr_min = 0; // p1: first percentile by nearest rank
    uint64_t psnr_min_frame = 0;
    double max_error = 0;
    uint64_t over_1_255 = 0; // pixels, of all images

    struct Sampled {
        double mean = 0, worst = 0; // worst: least SSIM, most FLIP
        uint64_t frames = 0;        // scored; 0 = the others mean nothing
    } ssim, flip;

    struct Changes {
        uint64_t images = 0; // that have what they are compared with; 0 = the others mean nothing
        double rms = 0, p50 = 0, p90 = 0, p99 = 0, max = 0;
        uint64_t max_frame = 0;
    };
    // rms over pixels and channels of the change of the error image since the frame before: what flickers or pops in
    // the run and does not in the exact path.
    Changes temporal;
    // Changes of the run's own pictures, without a reference. motion: rms of the change of the picture. pop: by how
    // much the change of a square of 16 x 16 pixels is above its changes in the frame before and after, the largest of
    // the image. A square that moves evenly has no pop; one in which something appears at once has.
    // error_pop: the same of the error image, so of what changes at once in the run and not in the exact path.
    Changes motion, pop, error_pop;

    std::optional<FoveaAccuracy> fovea; // none without foveation

    // Values of the worse eye, per scored frame; temporal is NaN where there is none.
    std::vector<double> frame_psnr, frame_temporal;
};

} // namespace gsc
