// SPDX-License-Identifier: Apache-2.0
// A run's images against the exact ones of the same poses: by themselves and from frame to frame.
#pragma once

#include "player/measure/fovea.h"
#include "runtime/metrics/metrics.h"

#include <cstdint>
#include <optional>
#include <vector>

namespace gsc {

struct ScoreOptions {
    uint32_t ssim_every = 0, flip_every = 0; // frames: 1 = each, 0 = none; both cost more than a frame
};

// Of an image with a pixel that is not finite, for which JSON has no word.
constexpr double kBrokenPsnr = -999, kWorstError = 1e30;

inline double boundedPsnr(double psnr)
{
    return psnr > kBrokenPsnr ? psnr : kBrokenPsnr;
}

// Every eye of every frame is an image. PSNR is +inf for equal images.
struct Accuracy {
    uint64_t images = 0;
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
    // The same measure of the run alone, without a reference: rms of the change of the picture, and by how much the one
    // of a square of 16 x 16 pixels is above those of the frame before and after, the largest of the image. A square
    // that moves evenly has none of the latter; one in which something appears at once has.
    Changes motion, pop;

    std::optional<FoveaAccuracy> fovea; // none without foveation

    // Of the worse eye, per frame; temporal is NaN where there is none.
    std::vector<double> frame_psnr, frame_temporal;
};

class Scorer {
public:
    explicit Scorer(const ScoreOptions& options) : m_options(options) {}

    // `gaze`: where there is foveation. Precondition: frames come in order from 0, each with the same eyes, `image` and
    // `exact` of one size.
    void add(uint64_t frame, uint32_t eye, const ImageView& image, const ImageView& exact,
             const EyeGaze* gaze = nullptr);

    [[nodiscard]] Accuracy result() const;

private:
    struct ErrorImage {
        uint32_t width = 0, height = 0;
        std::vector<float> values;
    };

    // rms of the change since the last call for this eye, NaN if there was none of this size.
    double change(uint32_t eye, const ImageView& image, const ImageView& exact);

    // What an eye's last pictures were like.
    struct Movement {
        uint32_t width = 0, height = 0;
        std::vector<float> last;                // pixels
        std::vector<double> before, now, after; // rms of the last changes, per square
        uint32_t known = 0;                     // pictures of this size in a row
    };
    void move(uint64_t frame, uint32_t eye, const ImageView& image);

    ScoreOptions m_options;
    Accuracy m_sums; // what grows image by image
    double m_mse = 0;
    std::vector<double> m_psnr, m_temporal, m_motion, m_pop, m_ssim, m_flip; // per image
    std::vector<ErrorImage> m_last;                                          // per eye
    std::vector<Movement> m_moves;                                           // per eye
    FoveaScorer m_fovea;
    std::vector<float> m_flip_map; // of the image at hand
};

} // namespace gsc
