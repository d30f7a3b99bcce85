// SPDX-License-Identifier: Apache-2.0
// Compares pictures with others, and keeps the scores one by one and together.
#pragma once

#include "runtime/image/image_io.h"
#include "runtime/cli/json.h"
#include "runtime/metrics/lpips.h"
#include "runtime/metrics/metrics.h"

#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace gsc {

struct ScoredPicture {
    std::string name;
    uint32_t width = 0, height = 0;
    // bits per channel of the trainer's picture; 0 = this is not a comparison with the trainer's pictures
    uint32_t picture_bits = 0;
    ImageDifference difference;
    double ssim = 0, flip = 0;
    std::optional<double> lpips; // none: whyNoLpips() says why
};

// Scores `actual` against `expected`, which must have the same size. LPIPS is left out if `lpips` is null or the
// pictures are too small for it.
ScoredPicture scorePicture(const std::string& name, const Image& expected, const Image& actual, const Lpips* lpips);

struct PictureSet {
    std::vector<ScoredPicture> views;
    PooledDifference pool;

    void add(ScoredPicture view);

    // These return means over the views. Precondition: there is at least one view.
    [[nodiscard]] double mse() const { return pool.mse_sum / double(pool.frames); }
    [[nodiscard]] double ssim() const;
    [[nodiscard]] double flip() const;
    [[nodiscard]] std::optional<double> lpips() const; // none if any view has none

    // Returns true if every view has `min_psnr` dB or more; a view whose PSNR is NaN fails.
    [[nodiscard]] bool passes(double min_psnr) const;
};

// Paths of the two files with LPIPS' weights (lpips_weights.h); both are set or none.
struct LpipsFiles {
    std::string backbone, heads;
};

// Opens LPIPS; null if no files are set. `threads`: 0 = all cores. Throws as readLpipsWeights().
std::unique_ptr<Lpips> openLpips(const LpipsFiles& files, int threads);
// Text that says why some view of `pictures` has no LPIPS score; empty if all have one.
std::string whyNoLpips(const Lpips* lpips, const PictureSet& pictures);

// JSON object of the scores for a report; null for an empty set.
OrderedJson pictureSetJson(const PictureSet& pictures);
// Text of the scores: a line for the whole set, which begins with `title`, and a line for each view.
std::string pictureSetText(const char* title, const PictureSet& pictures);

} // namespace gsc
