// SPDX-License-Identifier: Apache-2.0
#include "kernels/select/cut.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace gsc {

namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();
// The exact test of an anchor against the quick look at a group, in CPU time.
constexpr float kExactTestCost = 0.05f;
constexpr int kDoublings = 5; // 32 frames are long enough
constexpr CutEntry kNothing{{0, 0}, {0, 0}, -1, 0, 0, 0};

} // namespace

void CutCache::clear()
{
    for (Eye& eye : m_eyes)
        eye.poses.clear(); // begin() does the rest
}

void CutCache::begin(const SelectArgs& args, const EyeClassifier* eyes)
{
    m_model = args.model;
    const ModelParams& params = *args.model->params;
    for (uint32_t e = 0; e < args.eye_count; ++e) {
        Eye& eye = m_eyes[e];
        if (eye.groups.size() != params.group_count || eye.chunks.size() != params.chunk_count)
            eye.poses.clear();
        if (!eye.poses.begin(args.eyes[e], eyes[e], args.rules, args.lod_bias)) {
            eye.chunks.assign(params.chunk_count, kNothing);
            eye.groups.assign(params.group_count, kNothing);
        }
    }
}

template <typename Record>
void CutCache::keep(Eye& eye, CutEntry& entry, const Record& record, float slack) const
{
    entry.slack = slack >= 0 ? slack : -1.0f; // NaN is no slack
    entry.reach = farthest(record.anchor_min, record.anchor_max, eye.poses.classifier().bounds.center);
    entry.pose = eye.poses.now();
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
    const CutMotion last = eye.poses.step();
    // motion per frame
    float step =
        last.shift + last.turn * farthest(record.anchor_min, record.anchor_max, eye.poses.classifier().bounds.center);
    if (!(step < kEndlessSlack)) // a jump says nothing about the next frame
        step = 0;
    // lanes left to others than the exact test, by the frames that they last: fewer than 1, 2, 4, ...
    alignas(64) float settled[kGroupSize];
    for (uint32_t i = 0; i < kGroupSize; ++i)
        settled[i] = i < record.anchor_count && !(open[i / 64] >> i % 64 & 1) ? slacks[i] : kEndlessSlack;
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
    slack = kEndlessSlack;
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
