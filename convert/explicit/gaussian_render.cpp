// SPDX-License-Identifier: Apache-2.0
#include "convert/explicit/gaussian_render.h"

#include "kernels/blend/blend.h"

#include <algorithm>
#include <cmath>

namespace gsc {

namespace {

constexpr size_t kBlock = 1024; // Gaussians that a worker projects together
constexpr size_t kArrays = 14;  // of floats in a GaussianBlock
constexpr size_t kRoom = kBlock + kMaxLanes;

} // namespace

GaussianRenderer::GaussianRenderer(const GaussianSet& set, const double (&origin)[3], int threads)
    : m_set(set), m_origin(origin), m_workers(threads), m_values(size_t(m_workers.count())),
      m_origins(size_t(m_workers.count())), m_counts((set.size() + kBlock - 1) / kBlock)
{
    for (Buffer<float>& values : m_values) {
        values.reserve(kArrays * kRoom);
        std::fill_n(values.data(), kArrays * kRoom, 0.0f);
    }
    for (std::vector<uint16_t>& origins : m_origins)
        origins.resize(kRoom);
    m_splats.reserve(m_counts.size() * kBlock + kMaxLanes);
    m_depth_bits.reserve(m_counts.size() * kBlock + kMaxLanes);
}

uint32_t GaussianRenderer::drawBlock(size_t block, const EyeParams& eye, const RasterConstants& rules,
                                     GaussianBlock& gaussians)
{
    const size_t first = block * kBlock, n = shValues(m_set.degree);
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
    return projectBlockCpu({&eye, rules}, gaussians, m_splats.data() + first, m_depth_bits.data() + first,
                           gaussians.origin)
        .splats;
}

void GaussianRenderer::draw(const EyeParams& eye, const RasterConstants& rules, const float* background, float* image)
{
    m_workers.run(m_counts.size(), 1, [&](size_t begin, size_t end, int worker) {
        float* at = m_values[size_t(worker)].data();
        GaussianBlock gaussians{};
        const auto take = [&at](float*& to) {
            to = at;
            at += kRoom;
        };
        for (size_t i = 0; i < 3; ++i) {
            take(gaussians.position[i]);
            take(gaussians.scale[i]);
            take(gaussians.color[i]);
        }
        for (float*& rotation : gaussians.rotation)
            take(rotation);
        take(gaussians.opacity);
        gaussians.origin = m_origins[size_t(worker)].data();
        for (size_t block = begin; block < end; ++block)
            m_counts[block] = drawBlock(block, eye, rules, gaussians);
    });
    m_keys.clear();
    for (size_t block = 0; block < m_counts.size(); ++block)
        for (size_t i = 0; i < m_counts[block]; ++i)
            m_keys.push_back({m_depth_bits.data()[block * kBlock + i], uint32_t(block * kBlock + i)});
    std::stable_sort(m_keys.begin(), m_keys.end(),
                     [](const SortKey& a, const SortKey& b) { return a.depth_bits < b.depth_bits; });
    const uint32_t grid_x = tileCount(eye.width), grid_y = tileCount(eye.height);
    (void)binCpu({m_splats.data(), m_keys.data(), m_keys.size(), grid_x, grid_y}, m_workers, m_bin);
    BlendArgs args{m_bin.splats.data(),
                   m_bin.tile_first.data(),
                   m_bin.entries.data(),
                   grid_x,
                   grid_y,
                   eye.width,
                   eye.height,
                   rules,
                   {},
                   image};
    std::copy_n(background, 3, args.background);
    (void)blendCpu(args, m_workers);
}

} // namespace gsc
