// SPDX-License-Identifier: Apache-2.0
// Sums up the scores of a run's images against the exact images of its poses.
#pragma once

#include "runtime/records/score_options.h"
#include "runtime/metrics/picture_scorer.h"
#include "runtime/records/accuracy.h"

#include <cstdint>
#include <memory>
#include <vector>

namespace gsc {

// Sums up scores inside and outside the fovea.
class FoveaScorer {
public:
    // Adds a picture: its sums inside the fovea, then outside.
    void add(uint64_t frame, const FoveaSums (&sides)[2]);

    [[nodiscard]] bool empty() const { return m_sums[0].pixels + m_sums[1].pixels == 0; }
    [[nodiscard]] FoveaAccuracy result() const;

private:
    struct Sums {
        uint64_t pixels = 0, flip_pixels = 0;
        double squares = 0, flip = 0;
        double psnr_min = 0; // dB, of the worst image
        uint64_t psnr_min_frame = 0;
    };
    Sums m_sums[2]; // inside, outside
};

// Sums up the scores of all images of a run.
class Scorer {
public:
    // `pictures` scores single pictures.
    explicit Scorer(const ScoreOptions& options, std::unique_ptr<PictureScorer> pictures = makeHostScorer());

    // Adds an image. `gaze`: only with foveation. Precondition: all scored frames in order, and no other, each with as many
    // eyes; `image` and `exact` are of one size. Throws Error (OutOfMemory, Device).
    void add(uint64_t frame, uint32_t eye, const PictureRef& image, const PictureRef& exact,
             const EyeGaze* gaze = nullptr);

    [[nodiscard]] Accuracy result() const;

private:
    void addChanges(uint64_t frame, const PictureScores& scores);

    ScoreOptions m_options;
    std::unique_ptr<PictureScorer> m_pictures;
    Accuracy m_sums; // counts and extremes so far
    double m_mse = 0;
    std::vector<double> m_psnr, m_temporal, m_motion, m_pop, m_error_pop, m_ssim, m_flip; // per image
    FoveaScorer m_fovea;
};

} // namespace gsc
