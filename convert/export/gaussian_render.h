// SPDX-License-Identifier: Apache-2.0
// Draws explicit Gaussians with the arithmetic of tier `exact`, to measure how they differ from the model.
#pragma once

#include "convert/export/gaussian_set.h"
#include "runtime/cpu/frame_cpu.h"

namespace gsc {

class GaussianRenderer {
public:
    // `origin`: ModelView::origin of the model whose eyes are drawn from. `set` and `origin` must outlive this.
    GaussianRenderer(const GaussianSet& set, const double (&origin)[3], int threads);

    // Draws a picture. `image`: height x width x 3 floats, row by row from the top.
    void draw(const EyeParams& eye, const RasterConstants& rules, const float* background, float* image);

private:
    void fillBlock(size_t first, const EyeParams& eye, GaussianBlock& gaussians) const;

    const GaussianSet& m_set;
    const double (&m_origin)[3];
    CpuFrame m_frame;
};

} // namespace gsc
