// SPDX-License-Identifier: Apache-2.0
#include "tests/bench/bench_scene.h"

#include <algorithm>
#include <atomic>
#include <cmath>

namespace gsc::bench {

namespace {

constexpr float kBackground[3] = {0, 0, 0};
constexpr int kMaxWorkers = 256;

} // namespace

BenchScene::BenchScene(const ModelView& model, const EyeParams& eye, int32_t appearance)
    : m_model(model), m_eye(eye), m_appearance(appearance), m_rules(rasterConstants(*model.params, 0)),
      m_scratch(kMaxWorkers)
{
    const Workers one(1);
    SelectScratch scratch;
    SelectCounts counts{};
    m_visible_count = selectCpu({&m_model, &m_eye, 1, m_rules, 0}, one, scratch, m_visible, counts);
    m_selected = selectReference<float>(m_model, m_eye, m_rules, 0);
    m_image.resize(size_t(3) * eye.width * eye.height);
    m_reference_image.resize(m_image.size());
    projectAll();
    buildReference();
}

void BenchScene::projectAll()
{
    m_scratch[0] = std::make_unique<DecodeScratch>();
    reserveDecode(m_model, *m_scratch[0]);
    const DecodeArgs args = prepareDecode(m_model, &m_eye, 1, m_visible.data(), m_visible_count, m_appearance, m_bias);
    const size_t blocks = (m_visible_count + kDecodeBlock - 1) / kDecodeBlock;
    const uint32_t capacity = kDecodeBlock * m_model.params->n_offsets;
    m_splats.reserve(blocks * capacity);
    m_depths.reserve(blocks * capacity);
    m_origins.reserve(blocks * capacity);
    m_counts.reserve(blocks);
    for (size_t b = 0; b < blocks; ++b) {
        const size_t first = b * kDecodeBlock;
        decodeBlockCpu(args, first, uint32_t(std::min<size_t>(kDecodeBlock, m_visible_count - first)), *m_scratch[0]);
        m_counts[b] = projectBlockCpu({&m_eye, m_rules}, m_scratch[0]->blocks[0], m_splats.data() + b * capacity,
                                      m_depths.data() + b * capacity, m_origins.data() + b * capacity)
                          .splats;
    }
    const Workers one(1);
    const size_t count = sortCpu(
        {&m_model, m_visible.data(), m_depths.data(), m_origins.data(), m_counts.data(), uint32_t(blocks), capacity},
        one, m_sort);
    m_pairs = binCpu({m_splats.data(), m_sort.keys[0].data(), count, tileCount(m_eye.width), tileCount(m_eye.height)},
                     one, m_bin);
    for (size_t i = 0; i < count; ++i) {
        const Splat& s = m_bin.splats[i];
        SplatOf<float> same{};
        same.x = s.x;
        same.y = s.y;
        same.opacity = s.opacity;
        for (int c = 0; c < 3; ++c) {
            same.conic[c] = s.conic[c];
            same.color[c] = s.color[c];
        }
        m_same_splats.push_back(same);
    }
    const size_t tiles = size_t(tileCount(m_eye.width)) * tileCount(m_eye.height);
    m_same_lists.first.assign(m_bin.tile_first.data(), m_bin.tile_first.data() + tiles + 1);
    m_same_lists.entries.assign(m_bin.entries.data(), m_bin.entries.data() + m_pairs);
}

void BenchScene::buildReference()
{
    bool any_positive = false;
    const auto gaussians = gsc::decodeReference<float>(m_model, m_eye.center, m_selected, m_appearance, any_positive);
    m_gaussians = gaussians.size();
    uint64_t dropped = 0;
    m_full_splats = projectReference<float>(m_eye, m_rules, gaussians, dropped);
    m_full_lists =
        binReference(m_full_splats, sortReference(m_full_splats), tileCount(m_eye.width), tileCount(m_eye.height));
}

size_t BenchScene::decodeFast(const Workers& workers)
{
    const DecodeArgs args = prepareDecode(m_model, &m_eye, 1, m_visible.data(), m_visible_count, m_appearance, m_bias);
    const size_t blocks = (m_visible_count + kDecodeBlock - 1) / kDecodeBlock;
    for (int w = 0; w < workers.count(); ++w)
        if (m_scratch[size_t(w)] == nullptr) {
            m_scratch[size_t(w)] = std::make_unique<DecodeScratch>();
            reserveDecode(m_model, *m_scratch[size_t(w)]);
        }
    std::atomic<size_t> gaussians{0};
    workers.run(blocks, 1, [&](size_t begin, size_t end, int worker) {
        DecodeScratch& scratch = *m_scratch[size_t(worker)];
        for (size_t b = begin; b < end; ++b) {
            const size_t first = b * kDecodeBlock;
            decodeBlockCpu(args, first, uint32_t(std::min<size_t>(kDecodeBlock, m_visible_count - first)), scratch);
            gaussians.fetch_add(scratch.blocks[0].count, std::memory_order_relaxed);
        }
    });
    return gaussians;
}

size_t BenchScene::decodeReference()
{
    bool any_positive = false;
    return gsc::decodeReference<float>(m_model, m_eye.center, m_selected, m_appearance, any_positive).size();
}

uint64_t BenchScene::blendFast(const Workers& workers)
{
    BlendArgs args{m_bin.splats.data(),
                   m_bin.tile_first.data(),
                   m_bin.entries.data(),
                   tileCount(m_eye.width),
                   tileCount(m_eye.height),
                   m_eye.width,
                   m_eye.height,
                   m_rules,
                   {},
                   m_image.data()};
    return blendCpu(args, workers);
}

uint64_t BenchScene::blendReferenceSameLists()
{
    return blendReference(m_same_splats, m_same_lists, m_eye.width, m_eye.height, m_rules, kBackground,
                          m_reference_image.data());
}

uint64_t BenchScene::blendReferenceFullLists()
{
    return blendReference(m_full_splats, m_full_lists, m_eye.width, m_eye.height, m_rules, kBackground,
                          m_reference_image.data());
}

float BenchScene::worstDifference() const
{
    float worst = 0;
    for (size_t i = 0; i < m_image.size(); ++i)
        worst = std::max(worst, std::abs(m_image[i] - m_reference_image[i]));
    return worst;
}

} // namespace gsc::bench
