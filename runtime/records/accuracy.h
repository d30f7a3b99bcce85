// SPDX-License-Identifier: Apache-2.0
// Distance of a run's images from the exact images of its poses, over all frames.
#pragma once

#include "runtime/records/score_options.h"

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace gsc {

// PSNR (dB) and error of an image with a pixel that is not finite: JSON has no number for NaN or infinity.
constexpr double kBrokenPsnr = -999, kWorstError = 1e30;

inline double boundedPsnr(double psnr)
{
    return psnr > kBrokenPsnr ? psnr : kBrokenPsnr;
}

// Accuracy of pictures with foveation: inside the fovea, which is where an eye looks, and outside it. PSNR in dB; +inf: equal.
struct FoveaAccuracy {
    struct Part {
        double share = 0; // part of all pixels; 0 = the other fields mean nothing
        double psnr_pooled = 0, psnr_min = 0;
        uint64_t psnr_min_frame = 0;
        double flip = -1; // mean over pixels; -1 = not scored
    } inside, outside;
};

// Accuracy of both parts as one line for a person.
std::string foveaText(const FoveaAccuracy& accuracy);

// Accuracy of a run: each eye of each scored frame is one image. PSNR in dB, +inf for equal images; errors in 0..1.
struct Accuracy {
    uint64_t images = 0;
    ScoredFrames scored;
    double psnr_pooled = 0, psnr_p1 = 0, psnr_min = 0; // p1: first percentile by nearest rank
    uint64_t psnr_min_frame = 0;
    double max_error = 0;    // largest error of a channel of a pixel
    uint64_t over_1_255 = 0; // pixels with an error above 1/255, over all images

    struct Sampled {
        double mean = 0, worst = 0; // worst: least SSIM, most FLIP
        uint64_t frames = 0;        // scored frames; 0 = the other fields mean nothing
    } ssim, flip;

    struct Changes {
        uint64_t images = 0; // images with another frame to compare with; 0 = the other fields mean nothing
        double rms = 0, p50 = 0, p90 = 0, p99 = 0, max = 0;
        uint64_t max_frame = 0;
    };
    // Flicker that the exact path does not have: change of the error image since the frame before, rms over pixels and
    // channels.
    Changes temporal;
    // motion: rms change of the run's own picture, without a reference. pop: change of a square of 16 x 16 pixels beyond
    // its changes in the frame before and in the frame after, the largest of the image; a square that moves evenly has
    // none, a square in which something appears suddenly has one. error_pop: pop of the error image, without the sudden
    // changes that the exact path has too.
    Changes motion, pop, error_pop;

    std::optional<FoveaAccuracy> fovea; // none without foveation

    // Values of the worse eye, per scored frame; temporal is NaN for a frame without a scored frame before it.
    std::vector<double> frame_psnr, frame_temporal;
};

} // namespace gsc
