// SPDX-License-Identifier: Apache-2.0
// Pictures scored against others, one by one and together.
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
    uint32_t picture_bits = 0; // bits per channel of the trainer's picture; 0 = compared with another kind
    ImageDifference difference;
    double ssim = 0, flip = 0;
    std::optional<double> lpips; // whyNoLpips() says why there is none
};

// Precondition: equal sizes. Without `lpips`, or of pictures too small for it, there is no LPIPS.
ScoredPicture scorePicture(const std::string& name, const Image& expected, const Image& actual, const Lpips* lpips);

struct PictureSet {
    std::vector<ScoredPicture> views;
    PooledDifference pool;

    void add(ScoredPicture view);

    // Means over the views, of which there is at least one.
    [[nodiscard]] double mse() const { return pool.mse_sum / double(pool.frames); }
    [[nodiscard]] double ssim() const;
    [[nodiscard]] double flip() const;
    [[nodiscard]] std::optional<double> lpips() const; // none if a view has none

    // True if every view has `min_psnr` dB or more; a view without a number fails.
    [[nodiscard]] bool passes(double min_psnr) const;
};

// Files of LPIPS' weights (lpips_weights.h); both or none.
struct LpipsFiles {
    std::string backbone, heads;
};

// Null without files. Throws as readLpipsWeights(). `threads`: 0 = all cores.
std::unique_ptr<Lpips> openLpips(const LpipsFiles& files, int threads);
// Why a view of `pictures` has no LPIPS, in words; empty = all have.
std::string whyNoLpips(const Lpips* lpips, const PictureSet& pictures);

// JSON of the set for a report: an object, null for an empty set.
OrderedJson pictureSetJson(const PictureSet& pictures);
// A line of the set, headed `title`, and one of each view.
std::string pictureSetText(const char* title, const PictureSet& pictures);

} // namespace gsc
