// SPDX-License-Identifier: Apache-2.0
#include "convert/export/gaussian_render.h"

#include <algorithm>
#include <cmath>

namespace gsc {

namespace {

constexpr uint32_t kBlock = 1024; // Gaussians that a thread projects at once

} // namespace

GaussianRenderer::GaussianRenderer(const GaussianSet& set, const double (&origin)[3], int threads)
    : m_set(set), m_origin(origin), m_frame(threads)
{
    m_frame.capacity = kBlock;
    for (DecodeState& state : m_frame.states)
        reserveBlocks(kBlock, 0, state.scratch);
}

void GaussianRenderer::fillBlock(size_t first, const EyeParams& eye, GaussianBlock& gaussians) const
{
    const size_t n = shValues(m_set.degree);
    uint32_t count = 0;
    for (size_t i = first; i < std::min(first + kBlock, m_set.size()); ++i) {
        if (m_set.opacity[i] < kOpacityFloor)
            continue;
        float direction[3], length = 0, basis[kMostShValues];
        for (size_t c = 0; c < 3; ++c) {
            gaussians.position[c][count] = float(double(m_set.position[3 * i + c]) - m_origin[c]);
            gaussians.scale[c][count] = std::exp(m_set.log_scale[3 * i + c]);
            direction[c] = gaussians.position[c][count] - eye.center[c];
            length += direction[c] * direction[c];
        }
        for (float& d : direction)
            d /= std::sqrt(length);
        for (size_t c = 0; c < 4; ++c)
            gaussians.rotation[c][count] = m_set.rotation[4 * i + c];
        shBasis(m_set.degree, direction, basis);
        for (size_t c = 0; c < 3; ++c) {
            float sum = 0.5f;
            for (size_t k = 0; k < n; ++k)
                sum += basis[k] * m_set.color[(i * n + k) * 3 + c];
            gaussians.color[c][count] = std::max(sum, 0.0f);
        }
        gaussians.opacity[count] = m_set.opacity[i];
        gaussians.origin[count] = uint16_t(i - first);
        ++count;
    }
    gaussians.count = count;
}

void GaussianRenderer::draw(const EyeParams& eye, const RasterConstants& rules, const float* background, float* image)
{
    const size_t blocks = (m_set.size() + kBlock - 1) / kBlock;
    SplatStore& store = m_frame.stores[0];
    store.reserve(blocks, blocks * kBlock);
    for (DecodeState& state : m_frame.states)
        state.clearCounts();
    m_frame.workers.run(blocks, 1, [&](size_t begin, size_t end, int worker) {
        DecodeState& state = m_frame.states[size_t(worker)];
        for (size_t block = begin; block < end; ++block) {
            fillBlock(block * kBlock, eye, state.scratch.blocks[0]);
            projectInto(store, block, block * kBlock, {&eye, rules}, state.scratch.blocks[0], 0, state);
        }
    });
    FrameResult unread;
    m_frame.list(0, eye, blocks, nullptr, unread);
    BlendArgs args = m_frame.listed(eye, rules);
    std::copy_n(background, 3, args.background);
    args.image = image;
    (void)blendCpu(args, m_frame.workers);
}

} // namespace gsc
