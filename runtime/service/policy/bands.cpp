// SPDX-License-Identifier: Apache-2.0
#include "runtime/service/policy/bands.h"

#include <algorithm>
#include <numeric>

namespace gsc {

namespace {

constexpr double kNew = 0.5; // weight of the last frame's times; the costs learned before have the rest

uint32_t stepsOf(uint32_t width)
{
    return (width + kColumnStep - 1) / kColumnStep;
}

} // namespace

// Forgets the costs if the width of the image has changed.
void BandBalance::fit(uint32_t width)
{
    if (m_cost.size() != stepsOf(width))
        m_cost.assign(stepsOf(width), 1.0);
}

std::vector<ColumnRange> BandBalance::cut(uint32_t width, uint32_t count)
{
    fit(width);
    const auto steps = uint32_t(m_cost.size());
    count = std::clamp(count, 1u, steps);
    const double all = std::accumulate(m_cost.begin(), m_cost.end(), 0.0);
    std::vector<ColumnRange> bands;
    double sum = 0;
    uint32_t first = 0;
    for (uint32_t step = 0; step < steps; ++step) {
        const auto bands_left = uint32_t(count - bands.size());
        sum += m_cost[step];
        const double next = step + 1 < steps ? sum + m_cost[step + 1] : sum;
        const double goal = all * double(bands.size() + 1) / count;
        // a band ends where the sum of costs is nearest to its share; it has at least one step, and leaves one for
        // each band to come
        const bool near = next - goal > goal - sum;
        const bool must = steps - (step + 1) == bands_left - 1;
        if (step + 1 == steps || (bands_left > 1 && (near || must))) {
            bands.push_back({first * kColumnStep, (step + 1) * kColumnStep});
            first = step + 1;
        }
    }
    return bands;
}

void BandBalance::learn(uint32_t width, std::span<const ColumnRange> bands, std::span<const double> ms)
{
    fit(width);
    const double all_ms = std::accumulate(ms.begin(), ms.end(), 0.0);
    if (!(all_ms > 0))
        return;
    const double mean = all_ms / double(m_cost.size()); // the mean of the costs stays near 1
    for (size_t i = 0; i < bands.size(); ++i) {
        if (!(ms[i] > 0))
            continue;
        const uint32_t first = bands[i].first / kColumnStep, end = stepsOf(bands[i].end);
        const double before = std::accumulate(m_cost.begin() + first, m_cost.begin() + end, 0.0);
        // all columns of a band get the same factor; the differences between them come from other cuts
        const double factor = (1 - kNew) + kNew * (ms[i] / mean) / before;
        for (uint32_t step = first; step < end; ++step)
            m_cost[step] *= factor;
    }
}

} // namespace gsc
