// SPDX-License-Identifier: Apache-2.0
// Explicit Gaussians from anchors and networks. A Gaussian's place is the model's own. Its colour is fitted over the
// directions from which cameras see it, by spherical harmonics, least squares weighted by opacity over distance
// squared. Its opacity and shape are weighted means over those cameras.
#pragma once

#include "convert/export/gaussian_set.h"
#include "kernels/math/eye.h"

#include <cstdint>
#include <functional>
#include <span>

namespace gsc {

struct FitView {
    EyeParams eye;
    int32_t appearance; // row of the embedding, or -1
};

struct FitOptions {
    int degree = kMostShDegree;
    int threads = 0;
    bool as_seen = false; // export the Gaussians as the first and only view sees them: colours of degree 0
    RasterConstants rules{};
};

// Takes the Gaussians of some anchors. May throw.
using GaussianSink = std::function<void(const GaussianSet& part)>;

// The Gaussians that some of the views show, in the order of the file. Positions are the world's (ModelView::origin is
// added). progress(done, all) is called between anchors' ranges and views; it may throw. The result does not depend on
// the number of threads.
void fitGaussians(const ModelView& model, std::span<const FitView> views, const FitOptions& options,
                  const GaussianSink& take, const std::function<void(uint64_t, uint64_t)>& progress);

} // namespace gsc
