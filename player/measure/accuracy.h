// SPDX-License-Identifier: Apache-2.0
// The scores of a run's images against the exact ones of the same poses, over all of its frames.
#pragma once

#include "player/measure/fovea.h"
#include "runtime/metrics/picture_scorer.h"

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

namespace gsc {

// Every `every`-th frame is scored, from `first` on. Changes from frame to frame are known where `every` is 1.
struct ScoreOptions {
    uint32_t ssim_every = 0, flip_every = 0; // scored frames: 1 = each, 0 = none
    uint64_t every = 1, first = 0;

    [[nodiscard]] bool scores(uint64_t frame) const { return frame >= first && (frame - first) % every == 0; }
    [[nodiscard]] uint64_t scoredOf(uint64_t frames) const // of so many
    {
        return frames > first ? (frames - first - 1) / every + 1 : 0;
    }
};

// Of an image with a pixel that is not finite, for which JSON has no word.
constexpr double kBrokenPsnr = -999, kWorstError = 1e30;

inline double boundedPsnr(double psnr)
{
    return psnr > kBrokenPsnr ? psnr : kBrokenPsnr;
}

// Every eye of every scored frame is an image. PSNR is +inf for equal images.
struct Accuracy {
    uint64_t images = 0;
    uint64_t first_frame = 0, every_frame = 1;         // that was scored
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

    // Of the worse eye, per scored frame; temporal is NaN where there is none.
    std::vector<double> frame_psnr, frame_temporal;

    // The number of the i-th scored frame.
    [[nodiscard]] uint64_t frameOf(size_t i) const { return first_frame + i * every_frame; }
};

class Scorer {
public:
    // `pictures` scores each of them.
    explicit Scorer(const ScoreOptions& options, std::unique_ptr<PictureScorer> pictures = makeHostScorer());

    // `gaze`: where there is foveation. Precondition: frames come in order, each that is scored and no other, each with the
    // same eyes, `image` and `exact` of one size. Throws Error (OutOfMemory, Device).
    void add(uint64_t frame, uint32_t eye, const PictureRef& image, const PictureRef& exact,
             const EyeGaze* gaze = nullptr);

    [[nodiscard]] Accuracy result() const;

private:
    void addChanges(uint64_t frame, const PictureScores& scores);

    ScoreOptions m_options;
    std::unique_ptr<PictureScorer> m_pictures;
    Accuracy m_sums; // what grows image by image
    double m_mse = 0;
    std::vector<double> m_psnr, m_temporal, m_motion, m_pop, m_ssim, m_flip; // per image
    FoveaScorer m_fovea;
};

} // namespace gsc
