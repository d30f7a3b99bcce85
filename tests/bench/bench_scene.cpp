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
    : m_model(model), m_eye(eye), m_appearance(appearance), m_rules(rasterConstants(*model.params, 0)), m_frame(1),
      m_scratch(kMaxWorkers)
{
    m_selected = selectReference<float>(m_model, m_eye, m_rules, 0);
    m_image.resize(size_t(3) * eye.width * eye.height);
    m_reference_image.resize(m_image.size());
    listAll();
    buildReference();
}

void BenchScene::listAll()
{
    FrameOptions options;
    options.appearance = m_appearance;
    FrameResult result;
    m_frame.load(m_model);
    m_frame.select(&m_eye, 1, options, result);
    m_frame.decode(&m_eye, 1, options, result);
    const size_t count = m_frame.list(0, m_eye, m_frame.blocks(), nullptr, result);
    m_pairs = result.eyes[0].pairs;
    for (size_t i = 0; i < count; ++i) {
        const Splat& s = m_frame.bin.splats[i];
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
    const BlendArgs lists = m_frame.listed(m_eye, m_rules);
    m_same_lists.first.assign(lists.tile_first, lists.tile_first + tiles + 1);
    m_same_lists.entries.assign(lists.entries, lists.entries + m_pairs);
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
    const DecodeArgs args =
        prepareDecode(m_model, &m_eye, 1, m_frame.visible.data(), visible(), m_appearance, m_frame.bias);
    for (int w = 0; w < workers.count(); ++w)
        if (m_scratch[size_t(w)] == nullptr) {
            m_scratch[size_t(w)] = std::make_unique<DecodeScratch>();
            reserveDecode(m_model, *m_scratch[size_t(w)]);
        }
    std::atomic<size_t> gaussians{0};
    workers.run(m_frame.blocks(), 1, [&](size_t begin, size_t end, int worker) {
        DecodeScratch& scratch = *m_scratch[size_t(worker)];
        for (size_t b = begin; b < end; ++b) {
            const size_t first = b * kDecodeBlock;
            decodeBlockCpu(args, first, uint32_t(std::min<size_t>(kDecodeBlock, visible() - first)), scratch);
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
    BlendArgs args = m_frame.listed(m_eye, m_rules);
    args.image = m_image.data();
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
