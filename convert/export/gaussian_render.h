// SPDX-License-Identifier: Apache-2.0
// Draws explicit Gaussians with the arithmetic of `exact`, to measure their loss.
#pragma once

#include "convert/export/gaussian_set.h"
#include "runtime/cpu/frame_cpu.h"

namespace gsc {

class GaussianRenderer {
public:
    // `origin`: ModelView::origin of the model whose eyes look. Both outlive this.
    GaussianRenderer(const GaussianSet& set, const double (&origin)[3], int threads);

    // `image`: height x width x 3 floats.
    void draw(const EyeParams& eye, const RasterConstants& rules, const float* background, float* image);

private:
    void fillBlock(size_t first, const EyeParams& eye, GaussianBlock& gaussians) const;

    const GaussianSet& m_set;
    const double (&m_origin)[3];
    CpuFrame m_frame;
};

} // namespace gsc
