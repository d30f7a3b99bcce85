// SPDX-License-Identifier: Apache-2.0
#include "convert/export/lod/lod_model.h"

#include "convert/export/lod/stand_in.h"
#include <gsc/interrupt.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <span>

namespace gsc {

namespace {

// For each exported level that is the model's own, finest first: the finest level of the model in it. The stand-ins
// come after these.
std::vector<uint16_t> ownLevels(const GaussianSet& set)
{
    std::vector<size_t> counts; // for each level of the model: number of Gaussians on it and on all coarser levels
    for (const uint16_t level : set.level) {
        counts.resize(std::max(counts.size(), size_t(level) + 1));
        ++counts[level];
    }
    std::partial_sum(counts.begin(), counts.end(), counts.begin());
    std::vector<uint16_t> kept = {std::numeric_limits<uint16_t>::max()};
    size_t finer = set.size();
    for (size_t level = counts.size(); level-- > 0 && kept.size() < kMostLods;)
        if (counts[level] > 0 && counts[level] * 4 <= finer * 3) {
            kept.push_back(uint16_t(level));
            finer = counts[level];
        }
    return kept;
}

class Builder {
public:
    explicit Builder(GaussianSet& set) : m_set(set), m_own(ownLevels(set)), m_all(set.size())
    {
        std::iota(m_all.begin(), m_all.end(), 0u);
    }

    LodModel run()
    {
        addNode(m_all);
        addOwnLevels();
        addStandIns();
        for (size_t i = m_model.nodes.size(); i-- > 0;)
            bound(m_model.nodes[i]);
        return std::move(m_model);
    }

private:
    uint32_t addNode(std::span<uint32_t> which)
    {
        const auto number = uint32_t(m_model.nodes.size());
        m_model.nodes.emplace_back();
        if (which.size() <= kLodLeafGaussians) {
            m_model.nodes[number].levels.emplace_back(which.begin(), which.end());
            return number;
        }
        const size_t half = which.size() / 2;
        splitInSpace(m_set, which, half);
        const uint32_t lower = addNode(which.first(half)), upper = addNode(which.subspan(half));
        m_model.nodes[number].children = {lower, upper};
        return number;
    }

    void addOwnLevels()
    {
        m_model.counts.assign(m_own.size(), 0);
        for (LodNode& node : m_model.nodes) {
            if (!node.children.empty())
                continue;
            for (size_t i = 1; i < m_own.size(); ++i) {
                std::vector<uint32_t> some;
                std::ranges::copy_if(node.levels[0], std::back_inserter(some),
                                     [&](uint32_t g) { return m_set.level[g] <= m_own[i]; });
                node.levels.push_back(std::move(some));
            }
            for (size_t i = 0; i < m_own.size(); ++i)
                m_model.counts[i] += node.levels[i].size();
        }
    }

    void addStandIns()
    {
        while (m_model.counts.back() > kLodFewGaussians && m_model.counts.size() < kMostLods) {
            size_t count = 0;
            for (LodNode& node : m_model.nodes) {
                if (!node.children.empty())
                    continue;
                throwIfInterrupted();
                node.levels.push_back(appendStandIns(m_set, node.levels.back()));
                count += node.levels.back().size();
            }
            m_model.counts.push_back(count);
        }
    }

    void bound(LodNode& node) const
    {
        std::fill_n(node.least, 3, std::numeric_limits<float>::infinity());
        std::fill_n(node.most, 3, -std::numeric_limits<float>::infinity());
        for (const uint32_t child : node.children)
            for (size_t c = 0; c < 3; ++c) {
                node.least[c] = std::min(node.least[c], m_model.nodes[child].least[c]);
                node.most[c] = std::max(node.most[c], m_model.nodes[child].most[c]);
            }
        for (const std::vector<uint32_t>& level : node.levels)
            for (const uint32_t g : level)
                include(node, g);
    }

    void include(LodNode& node, uint32_t g) const
    {
        const float* q = m_set.rotation.data() + size_t(4) * g;
        const float rows[3][3] = {
            {1 - 2 * (q[2] * q[2] + q[3] * q[3]), 2 * (q[1] * q[2] - q[0] * q[3]), 2 * (q[1] * q[3] + q[0] * q[2])},
            {2 * (q[1] * q[2] + q[0] * q[3]), 1 - 2 * (q[1] * q[1] + q[3] * q[3]), 2 * (q[2] * q[3] - q[0] * q[1])},
            {2 * (q[1] * q[3] - q[0] * q[2]), 2 * (q[2] * q[3] + q[0] * q[1]), 1 - 2 * (q[1] * q[1] + q[2] * q[2])}};
        for (size_t c = 0; c < 3; ++c) {
            float variance = 0;
            for (size_t k = 0; k < 3; ++k) {
                const float side = rows[c][k] * std::exp(m_set.log_scale[size_t(3) * g + k]);
                variance += side * side;
            }
            const float place = m_set.position[size_t(3) * g + c], reach = std::sqrt(variance);
            node.least[c] = std::min(node.least[c], place - reach);
            node.most[c] = std::max(node.most[c], place + reach);
        }
    }

    GaussianSet& m_set;
    std::vector<uint16_t> m_own;
    std::vector<uint32_t> m_all;
    LodModel m_model;
};

} // namespace

LodModel makeLodModel(GaussianSet& set)
{
    return Builder(set).run();
}

} // namespace gsc
