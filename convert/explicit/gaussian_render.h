// SPDX-License-Identifier: Apache-2.0
// Draws explicit Gaussians with the arithmetic of `exact`, to tell what they lost.
#pragma once

#include "convert/explicit/gaussian_set.h"
#include "kernels/bin/bin.h"
#include "kernels/threads/parallel.h"

#include <vector>

namespace gsc {

class GaussianRenderer {
public:
    // `origin`: ModelView::origin of the model whose eyes look. Both outlive this.
    GaussianRenderer(const GaussianSet& set, const double (&origin)[3], int threads);

    // `image`: height x width x 3 floats.
    void draw(const EyeParams& eye, const RasterConstants& rules, const float* background, float* image);

private:
    uint32_t drawBlock(size_t block, const EyeParams& eye, const RasterConstants& rules, GaussianBlock& gaussians);

    const GaussianSet& m_set;
    const double (&m_origin)[3];
    Workers m_workers;
    std::vector<Buffer<float>> m_values; // per worker
    std::vector<std::vector<uint16_t>> m_origins;
    Buffer<Splat> m_splats;
    Buffer<uint32_t> m_depth_bits;
    std::vector<uint32_t> m_counts; // per block
    std::vector<SortKey> m_keys;
    BinScratch m_bin;
};

} // namespace gsc
