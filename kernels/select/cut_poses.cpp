// SPDX-License-Identifier: Apache-2.0
#include "kernels/select/cut_poses.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

namespace gsc {

namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();

float scaleOf(const float* n)
{
    const float length = std::sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
    return length > 0 ? 1 / length : 0; // then nothing is ever a margin
}

// Adds up the largest motion of the planes it is shown.
class Motion {
public:
    explicit Motion(const float* center)
    {
        for (int i = 0; i < 3; ++i)
            m_center[i] = center[i];
        m_center_length = std::sqrt(m_center[0] * m_center[0] + m_center[1] * m_center[1] + m_center[2] * m_center[2]);
    }

    void add(const float* from_n, float from_offset, const float* to_n, float to_offset, float scale)
    {
        const double offset = double(to_offset) - double(from_offset);
        double square = 0, at_center = offset;
        for (int i = 0; i < 3; ++i) {
            const double change = double(to_n[i]) - double(from_n[i]);
            square += change * change;
            at_center += change * m_center[i];
        }
        // the second terms: what the slack of the later test, a share of its summands, can have grown by
        const double turn = std::sqrt(square) * double(scale);
        const double spare = double(kPlaneSlack) * (turn * m_center_length + std::abs(offset) * double(scale));
        m_turn = std::max(m_turn, turn * (1 + double(kPlaneSlack)));
        const double shift = std::abs(at_center) * double(scale) + spare;
        m_shift = std::max(m_shift, shift);
        m_valid &= turn >= 0 && shift >= 0; // false for NaN
    }

    // Distances are taken from coordinates in fp32, hence the roundings of the coordinates: 1e-6 of |c| + |x - c|.
    [[nodiscard]] CutMotion result(const float* center)
    {
        double square = 0;
        for (int i = 0; i < 3; ++i)
            square += (double(center[i]) - m_center[i]) * (double(center[i]) - m_center[i]);
        m_shift = std::max(m_shift, std::sqrt(square) + 2e-6 * m_center_length);
        m_valid &= square >= 0;
        if (!m_valid)
            return {kInfinity, kInfinity};
        return {float(m_turn * 1.0001 + 2e-6), float(m_shift * 1.0001 + 1e-30)};
    }

private:
    double m_center[3], m_center_length;
    double m_turn = 0, m_shift = 0;
    bool m_valid = true;
};

} // namespace

CutScales cutScales(const EyeClassifier& eye)
{
    CutScales scales{};
    for (int i = 0; i < 5; ++i)
        scales.bounds[i] = scaleOf(eye.bounds.planes[i].n);
    for (int i = 0; i < 4; ++i)
        scales.inside[i] = scaleOf(eye.inside[i].n);
    scales.depth = scaleOf(eye.depth);
    return scales;
}

CutMotion cutMotion(const EyeParams& from_eye, const EyeClassifier& from, const CutScales& scales,
                    const EyeParams& to_eye, const EyeClassifier& to)
{
    // note: an outcome of the same frame over again needs no margin, not even for what took the exact test
    if (std::memcmp(&from_eye, &to_eye, sizeof(EyeParams)) == 0)
        return {0, 0};
    if (from_eye.width != to_eye.width || from_eye.height != to_eye.height || from.usable != to.usable ||
        from.depth_min != to.depth_min || from.depth_max != to.depth_max)
        return {kInfinity, kInfinity};
    Motion motion(from.bounds.center);
    for (int i = 0; i < 5; ++i) {
        const BoundPlane &a = from.bounds.planes[i], &b = to.bounds.planes[i];
        if (!(std::fabs(b.sigma_factor - a.sigma_factor) <= kSigmaDrift * a.sigma_factor))
            return {kInfinity, kInfinity};
        motion.add(a.n, a.offset, b.n, b.offset, scales.bounds[i]);
    }
    for (int i = 0; i < 4; ++i)
        motion.add(from.inside[i].n, from.inside[i].offset, to.inside[i].n, to.inside[i].offset, scales.inside[i]);
    motion.add(from.depth, from.depth[3], to.depth, to.depth[3], scales.depth);
    return motion.result(to.bounds.center);
}

bool CutPoses::begin(const EyeParams& eye, const EyeClassifier& classifier, const RasterConstants& rules,
                     float lod_bias)
{
    // of the rules, those that visibility depends on
    const bool same = m_now > 0 && m_lod_bias == lod_bias && rules.gsplat == m_rules.gsplat &&
                      rules.near_z == m_rules.near_z && rules.far_z == m_rules.far_z &&
                      rules.eigen_floor == m_rules.eigen_floor;
    if (!same) {
        m_rules = rules;
        m_lod_bias = lod_bias;
        m_now = 0;
    }
    if (same && std::memcmp(&m_poses[m_now % kCutPoses].eye, &eye, sizeof(EyeParams)) == 0)
        return true; // it stands: the motions are the last frame's
    ++m_now;
    m_poses[m_now % kCutPoses] = {eye, classifier, cutScales(classifier)};
    for (uint32_t i = m_now >= kCutPoses ? m_now - kCutPoses + 1 : 1; i <= m_now; ++i) {
        const Pose& from = m_poses[i % kCutPoses];
        m_motion[i % kCutPoses] = cutMotion(from.eye, from.classifier, from.scales, eye, classifier);
    }
    return same;
}

} // namespace gsc
