// SPDX-License-Identifier: Apache-2.0
// Computes explicit Gaussians from anchors and networks. The position is the model's own. The colour is fitted with
// spherical harmonics over the directions from which cameras see the Gaussian: least squares, weighted by opacity over
// distance squared. Opacity and shape are weighted means over those cameras; a shape is made smaller by half of what the
// mean of different directions made it larger.
#pragma once

#include "convert/export/gaussian_set.h"
#include "kernels/math/eye.h"

#include <cstdint>
#include <functional>
#include <span>

namespace gsc {

struct FitView {
    EyeParams eye;
    int32_t appearance; // row of the appearance embedding; -1 = none
};

struct FitOptions {
    int degree = kMostShDegree;
    int threads = 0;
    // export the Gaussians as the first and only view sees them, with colours of degree 0
    bool as_seen = false;
    RasterConstants rules{};
};

// Takes the Gaussians of some anchors. May throw.
using GaussianSink = std::function<void(GaussianSet&& part)>;

// Computes all Gaussians that at least one view shows, in the order of the file, with positions in world space
// (ModelView::origin is added). `progress(done, all)` is called between views; it may throw. The result does not depend
// on the number of threads.
void fitGaussians(const ModelView& model, std::span<const FitView> views, const FitOptions& options,
                  const GaussianSink& take, const std::function<void(uint64_t, uint64_t)>& progress);

} // namespace gsc
