// SPDX-License-Identifier: Apache-2.0
#include "runtime/service/policy/frame_cost.h"

#include <glm/mat4x4.hpp>
#include <glm/matrix.hpp>
#include <glm/vec4.hpp>

#include <algorithm>

namespace gsc {

namespace {

constexpr double kForget = 0.97; // factor by which the weight of earlier frames falls with each new frame
// weight of the assumption that the four terms (1 and three counts) cost the same; a frame has weight 1
constexpr double kPrior = 0.02;

} // namespace

FrameLoad loadOf(const FrameResult& result)
{
    FrameLoad load;
    for (const EyeCounts& eye : result.eyes) {
        load.anchors += double(eye.anchors_visible);
        load.pairs += double(eye.pairs);
        load.evaluations += double(eye.blend_evaluations);
    }
    return load;
}

FrameCost::Terms FrameCost::termsOf(const FrameLoad& load) const
{
    const auto ratio = [](double value, double unit) { return unit > 0 ? value / unit : 0.0; };
    return {1, ratio(load.anchors, m_unit.anchors), ratio(load.pairs, m_unit.pairs),
            ratio(load.evaluations, m_unit.evaluations)};
}

// Changes the units of counts. A count that is far larger than its unit would make the sums ill-conditioned, and a
// unit of 0 would lose it. The unit then becomes the count, and the sums are converted to it.
void FrameCost::growUnits(const FrameLoad& load)
{
    constexpr double kFar = 8;
    constexpr double FrameLoad::*kCounts[] = {&FrameLoad::anchors, &FrameLoad::pairs, &FrameLoad::evaluations};
    for (size_t i = 1; i < 4; ++i) {
        double& unit = m_unit.*kCounts[i - 1];
        const double value = load.*kCounts[i - 1];
        if (value <= kFar * unit)
            continue;
        const double scale = unit / value;
        for (size_t j = 0; j < 4; ++j) {
            m_products[i][j] *= scale;
            m_products[j][i] *= scale;
        }
        m_with_ms[i] *= scale;
        unit = value;
    }
}

void FrameCost::learn(ServiceTime at, const FrameLoad& load, double ms)
{
    if (m_seen.empty())
        m_mean_ms = ms;
    growUnits(load);
    m_mean_ms = kForget * m_mean_ms + (1 - kForget) * ms;
    const Terms terms = termsOf(load);
    for (int i = 0; i < 4; ++i) {
        for (int j = 0; j < 4; ++j)
            m_products[i][j] = kForget * m_products[i][j] + terms[i] * terms[j];
        m_with_ms[i] = kForget * m_with_ms[i] + terms[i] * ms;
    }
    m_seen.push_back({std::chrono::duration<double>(at).count(), load});
    if (m_seen.size() > kSeen)
        m_seen.pop_front();
}

// Solves for the weights by least squares; where the frames leave them open, they tend to equal weights.
FrameCost::Terms FrameCost::weights() const
{
    glm::dmat4 products(0.0);
    glm::dvec4 right(0.0);
    const double equal = m_mean_ms / 4;
    for (int i = 0; i < 4; ++i) {
        for (int j = 0; j < 4; ++j)
            products[j][i] = m_products[i][j];
        products[i][i] += kPrior;
        right[i] = m_with_ms[size_t(i)] + kPrior * equal;
    }
    const glm::dvec4 found = glm::inverse(products) * right;
    return {found[0], found[1], found[2], found[3]};
}

double FrameCost::costOf(const FrameLoad& load) const
{
    if (m_seen.empty())
        return 0;
    const Terms terms = termsOf(load), by = weights();
    double ms = 0;
    for (size_t i = 0; i < 4; ++i)
        ms += terms[i] * by[i];
    return std::max(ms, 0.0);
}

FrameLoad FrameCost::loadAt(ServiceTime at) const
{
    if (m_seen.empty())
        return {};
    const double until = std::min(std::chrono::duration<double>(at).count(),
                                  m_seen.back().at + std::chrono::duration<double>(kHorizon).count());
    double mean = 0;
    for (const Seen& seen : m_seen)
        mean += seen.at / double(m_seen.size());
    double spread = 0;
    for (const Seen& seen : m_seen)
        spread += (seen.at - mean) * (seen.at - mean);
    const auto goOn = [&](double FrameLoad::*count) {
        double average = 0, product = 0;
        for (const Seen& seen : m_seen) {
            average += seen.load.*count / double(m_seen.size());
            product += (seen.at - mean) * (seen.load.*count);
        }
        return std::max(0.0, average + (spread > 0 ? product / spread : 0) * (until - mean));
    };
    return {goOn(&FrameLoad::anchors), goOn(&FrameLoad::pairs), goOn(&FrameLoad::evaluations)};
}

double FrameCost::predict(ServiceTime at) const
{
    return costOf(loadAt(at));
}

} // namespace gsc
