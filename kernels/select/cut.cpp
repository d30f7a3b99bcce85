// SPDX-License-Identifier: Apache-2.0
#include "kernels/select/cut.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

namespace gsc {

namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr float kNoBound = std::numeric_limits<float>::max();
// The exact test of an anchor against the quick look at a group, in CPU time.
constexpr float kExactTestCost = 0.05f;
constexpr int kDoublings = 5; // 32 frames are long enough
constexpr CutEntry kNothing{{0, 0}, {0, 0}, -1, 0, 0, 0};

float scaleOf(const float* n)
{
    const float length = std::sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
    return length > 0 ? 1 / length : kInfinity; // then 0 or NaN times it is never a margin
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
        m_shift = std::max(m_shift, std::abs(at_center) * double(scale) + spare);
        m_valid &= turn >= 0 && m_shift >= 0; // false for NaN
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

// What distance allows: `margin` is that of ln(distance), slack included.
float levelSlack(float distance, float margin)
{
    return margin > 0 ? 0.999f * distance * (margin / (1 + margin)) : 0.0f;
}

float farthest(const float* box_min, const float* box_max, const float* center)
{
    float square = 0;
    for (int i = 0; i < 3; ++i) {
        const float way = maxNumber(std::fabs(box_min[i] - center[i]), std::fabs(box_max[i] - center[i]));
        square += way * way;
    }
    return std::sqrt(square) * 1.00001f;
}

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

float boxSlack(const EyeClassifier& eye, const CutScales& scales, const LodClassifier& lod, const float* box_min,
               const float* box_max, float sigma, float extra_max)
{
    if (lod.test == LodTest::Never)
        return kNoBound;
    float slack = 0;
    for (int p = 0; p < 5; ++p) {
        const BoundPlane& plane = eye.bounds.planes[p];
        float value = plane.offset + plane.sigma_factor * sigma;
        float magnitude = std::fabs(plane.offset) + plane.sigma_factor * sigma;
        for (int i = 0; i < 3; ++i) {
            const float corner = plane.n[i] > 0 ? box_max[i] : box_min[i];
            value += plane.n[i] * corner;
            magnitude += std::fabs(plane.n[i] * corner);
        }
        const float margin = -(value + kCutPlaneSlack * magnitude) * scales.bounds[p];
        slack = margin > slack ? margin : slack; // NaN is no margin
    }
    if (lod.test == LodTest::Distance) {
        float square = 0;
        for (int i = 0; i < 3; ++i) {
            const float low = box_min[i] + lod.shift, high = box_max[i] + lod.shift, c = eye.bounds.center[i];
            const float gap = maxNumber(0.0f, maxNumber(low - c, c - high));
            square += gap * gap;
        }
        const float nearest = std::sqrt(square);
        const float margin = std::log(nearest) - (lod.limit + lod.slope * extra_max) - kCutLodSlack;
        const float level = levelSlack(nearest, margin);
        slack = level > slack ? level : slack;
    }
    return slack;
}

void CutCache::clear()
{
    for (Eye& eye : m_eyes)
        eye.now = 0; // begin() does the rest
}

void CutCache::begin(const SelectArgs& args, const EyeClassifier* eyes)
{
    m_model = args.model;
    const ModelParams& params = *args.model->params;
    for (uint32_t e = 0; e < args.eye_count; ++e) {
        Eye& eye = m_eyes[e];
        const RasterConstants& a = args.rules;
        const RasterConstants& b = eye.rules.raster;
        // of the rules, those that visibility depends on
        const bool same = eye.now > 0 && eye.groups.size() == params.group_count &&
                          eye.chunks.size() == params.chunk_count && eye.rules.lod_bias == args.lod_bias &&
                          a.gsplat == b.gsplat && a.near_z == b.near_z && a.far_z == b.far_z &&
                          a.eigen_floor == b.eigen_floor;
        if (!same) {
            eye.chunks.assign(params.chunk_count, kNothing);
            eye.groups.assign(params.group_count, kNothing);
            eye.rules = {args.rules, args.lod_bias};
            eye.now = 0;
        }
        const bool stands =
            eye.now > 0 && std::memcmp(&eye.pose[eye.now % kPoses].eye, args.eyes + e, sizeof(EyeParams)) == 0;
        if (stands)
            continue; // the motions are the last frame's
        ++eye.now;
        eye.pose[eye.now % kPoses] = {args.eyes[e], eyes[e], cutScales(eyes[e])};
        for (uint32_t i = eye.now >= kPoses ? eye.now - kPoses + 1 : 1; i <= eye.now; ++i) {
            const Pose& from = eye.pose[i % kPoses];
            eye.motion[i % kPoses] = cutMotion(from.eye, from.classifier, from.scales, args.eyes[e], eyes[e]);
        }
    }
}

template <typename Record>
void CutCache::keep(Eye& eye, CutEntry& entry, const Record& record, float slack) const
{
    entry.slack = slack >= 0 ? slack : -1.0f; // NaN is no slack
    entry.reach = farthest(record.anchor_min, record.anchor_max, eye.pose[eye.now % kPoses].classifier.bounds.center);
    entry.pose = eye.now;
}

void CutCache::keepChunk(uint32_t e, size_t chunk, float slack)
{
    keep(m_eyes[e], m_eyes[e].chunks[chunk], m_model->chunks[chunk], slack);
}

void CutCache::keepGroup(uint32_t e, size_t group, float slack, const uint64_t* visible, const uint64_t* open)
{
    CutEntry& entry = m_eyes[e].groups[group];
    std::copy_n(visible, kGroupSize / 64, entry.visible);
    std::copy_n(open, kGroupSize / 64, entry.open);
    keep(m_eyes[e], entry, m_model->groups[group], slack);
}

float CutCache::settle(uint32_t e, size_t group, const float* slacks, uint64_t* open) const
{
    const Eye& eye = m_eyes[e];
    const GroupRecord& record = m_model->groups[group];
    const CutMotion& last = eye.motion[(eye.now + kPoses - 1) % kPoses];
    float step = 0; // motion per frame
    if (eye.now > 1)
        step = last.shift + last.turn * farthest(record.anchor_min, record.anchor_max,
                                                 eye.pose[eye.now % kPoses].classifier.bounds.center);
    if (!(step < kNoBound)) // a jump says nothing about the next frame
        step = 0;
    // lanes left to others than the exact test, by the frames that they last: fewer than 1, 2, 4, ...
    alignas(64) float settled[kGroupSize];
    for (uint32_t i = 0; i < kGroupSize; ++i)
        settled[i] = i < record.anchor_count && !(open[i / 64] >> i % 64 & 1) ? slacks[i] : kNoBound;
    float limit = 0, least = kInfinity;
    for (int doubling = 0; doubling <= kDoublings; ++doubling) {
        const float below = step * float(1 << doubling);
        uint32_t count = 0;
        for (const float slack : settled)
            count += slack < below;
        const float cost = kExactTestCost * float(count) + 1 / float(1 << doubling);
        if (cost < least) {
            least = cost;
            limit = below;
        }
    }
    float slack = *std::min_element(settled, settled + kGroupSize);
    if ((slack > step ? step / slack : 1.0f) <= least)
        return slack;
    slack = kNoBound;
    for (uint32_t i = 0; i < kGroupSize; ++i) {
        if (settled[i] < limit)
            open[i / 64] |= uint64_t(1) << i % 64;
        else
            slack = std::min(slack, settled[i]);
    }
    return slack;
}

uint64_t CutCache::bytes() const
{
    uint64_t bytes = 0;
    for (const Eye& eye : m_eyes)
        if (eye.groups.capacity() > 0)
            bytes += sizeof(Eye) + (eye.chunks.capacity() + eye.groups.capacity()) * sizeof(CutEntry);
    return bytes;
}

} // namespace gsc
