// SPDX-License-Identifier: Apache-2.0
// The half of CpuReuse that decides: what is drawn again, what is decoded, and in which order within the budget.
#include "runtime/reuse_cpu.h"

#include "kernels/math/anchor.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace gsc {

namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();

// An entry is decoded for where the camera will be when half its life is over: the error then starts below the bound,
// falls to zero and rises again, and the entry lives up to twice as long. It starts at this share of the bound.
constexpr float kLeadShare = 0.7f;
constexpr float kMaxLeadFrames = 64;

uint32_t lanesOf(const GroupMask& mask, uint32_t eye, uint32_t strip)
{
    constexpr uint32_t kPerWord = 64 / kStripAnchors;
    return uint32_t(mask.visible[eye][strip / kPerWord] >> (strip % kPerWord * kStripAnchors)) & 0xffffu;
}

float tolerance(const ReuseOptions& reuse)
{
    return reuse.bound / 255.0f;
}

} // namespace

// Share of the visible anchors, of all eyes, that the frame before did not see.
float CpuReuse::updateRate(const ReuseFrame& frame)
{
    uint64_t visible = 0, fresh = 0;
    for (size_t b = 0; b < m_groups.size(); ++b) {
        const GroupMask& mask = frame.selected.groups[m_candidates[b]];
        for (uint32_t e = 0; e < frame.eye_count; ++e) {
            Seen& seen = m_seen[e][mask.group];
            for (uint32_t w = 0; w < kGroupSize / 64; ++w) {
                const uint64_t before = seen.frame + 1 == m_frame ? seen.lanes[w] : 0;
                visible += uint64_t(__builtin_popcountll(mask.visible[e][w]));
                fresh += uint64_t(__builtin_popcountll(mask.visible[e][w] & ~before));
                seen.lanes[w] = mask.visible[e][w];
            }
            seen.frame = m_frame;
        }
    }
    return visible > 0 ? float(double(fresh) / double(visible)) : 0.0f;
}

// Where to decode from so that the entry lives long: ahead on the camera's way by half its life. The change it starts
// with is a share of the bound, or half the level at which the budget refreshes entries, where that is higher.
void CpuReuse::chooseCenter(const ReuseFrame& frame, const GroupAnchors& anchors, uint32_t strip, uint32_t eye,
                            EyeWork& work) const
{
    const ReuseOptions& reuse = frame.options.reuse;
    const float* now = frame.eyes[eye].center;
    std::copy_n(now, 3, work.center);
    if (reuse.policy != ReusePolicy::Error || m_history < 2)
        return;
    float next[3];
    for (int i = 0; i < 3; ++i)
        next[i] = now[i] + m_step[eye][i];
    work.rate = stripError(anchors, strip, work.lanes, next, now);
    if (!m_steady[eye])
        return;
    const float most = std::max(kLeadShare * tolerance(reuse), 0.5f * m_level[eye]);
    float frames = std::min(most / work.rate, kMaxLeadFrames); // 0.5: decoded again in the next frame whatever is done
    // note: the change is not linear in the motion close by
    for (int attempt = 0; attempt < 2 && frames > 0.5f; ++attempt) {
        float ahead[3];
        for (int i = 0; i < 3; ++i)
            ahead[i] = now[i] + frames * m_step[eye][i];
        const float error = stripError(anchors, strip, work.lanes, ahead, now);
        if (error <= most) {
            std::copy_n(ahead, 3, work.center);
            return;
        }
        frames *= 0.9f * most / error;
    }
}

void CpuReuse::scheduleStrip(const ReuseFrame& frame, const GroupAnchors& anchors, uint32_t strip, uint64_t strip_id,
                             StripWork& work)
{
    const ReuseOptions& reuse = frame.options.reuse;
    const bool by_error = reuse.policy == ReusePolicy::Error;
    const float bound = tolerance(reuse);
    for (uint32_t e = 0; e < frame.eye_count; ++e) {
        EyeWork& eye = work.eye[e];
        if (eye.lanes == 0)
            continue;
        const float* now = frame.eyes[e].center;
        eye.slot = m_cache.find(strip_id, e);
        eye.error = kInfinity;
        if (eye.slot != kNoSlot)
            eye.error = by_error ? stripError(anchors, strip, eye.lanes, m_cache.entry(eye.slot).center, now)
                                 : float(m_frame - m_cache.entry(eye.slot).decoded);
        const auto good = [&](float error) { return by_error ? error <= bound : error <= float(m_depth); };
        if (by_error && frame.eye_count > 1 && !good(eye.error)) {
            // the other eye's entry, unless this frame replaces it
            const EyeWork& first = work.eye[0];
            const uint32_t other = m_cache.find(strip_id, 1 - e);
            if (other != kNoSlot && !(e == 1 && first.due)) {
                const float error = stripError(anchors, strip, eye.lanes, m_cache.entry(other).center, now);
                if (error < eye.error) {
                    eye.error = error;
                    eye.slot = other;
                }
            }
            eye.shares = e == 1 && first.due && good(stripError(anchors, strip, eye.lanes, first.center, now));
        }
        eye.due = !good(eye.error) && !eye.shares;
        if (eye.due || (e == 0 && frame.eye_count > 1))
            chooseCenter(frame, anchors, strip, e, eye);
    }
    // an entry that this frame replaces is nobody else's any more
    if (frame.eye_count > 1 && work.eye[1].due && work.eye[0].lanes != 0 && !work.eye[0].due &&
        work.eye[0].slot != kNoSlot && m_cache.entry(work.eye[0].slot).eye == 1)
        work.eye[0].due = true;
    for (const EyeWork& eye : work.eye)
        if (eye.slot != kNoSlot)
            m_cache.entry(eye.slot).used = m_frame;
}

void CpuReuse::scheduleBlock(const ReuseFrame& frame, size_t block)
{
    const GroupRecord& group = m_model.groups[m_groups[block]];
    const GroupMask& mask = frame.selected.groups[m_candidates[block]];
    GroupAnchors anchors;
    if (frame.options.reuse.policy == ReusePolicy::Error)
        loadGroupAnchors(m_model, sensitivity(), group, anchors);
    for (uint32_t s = 0; s < kStripsPerGroup; ++s) {
        StripWork& work = m_work[block * kStripsPerGroup + s];
        work = {};
        uint32_t seen = 0;
        for (uint32_t e = 0; e < frame.eye_count; ++e) {
            work.eye[e].lanes = uint16_t(lanesOf(mask, e, s));
            seen |= work.eye[e].lanes;
        }
        if (seen != 0)
            scheduleStrip(frame, anchors, s, uint64_t(m_groups[block]) * kStripsPerGroup + s, work);
    }
}

// Of what is due, what the budget lets be decoded. What was never decoded always is: a hole shows more than any age.
// What is left of the budget goes to the largest errors.
void CpuReuse::grant(const ReuseFrame& frame)
{
    const uint64_t budget = frame.options.reuse.decode_budget;
    for (uint32_t e = 0; e < frame.eye_count; ++e) {
        m_budgeted.clear();
        uint64_t granted = 0, due = 0;
        double rates = 0;
        for (uint32_t w = 0; w < m_work.size(); ++w) {
            EyeWork& eye = m_work[w].eye[e];
            eye.decode = eye.due && (budget == 0 || eye.slot == kNoSlot);
            if (!eye.due)
                continue;
            const uint32_t anchors = stripAnchors(w / kStripsPerGroup, w % kStripsPerGroup);
            due += anchors;
            if (eye.decode)
                granted += anchors;
            else
                m_budgeted.push_back({eye.error, w});
            if (eye.rate < kInfinity) // a camera on an anchor changes everything at once
                rates += double(eye.rate) * anchors;
        }
        // entries that all reach the same level before they are decoded again use the budget up exactly
        m_level[e] = due > budget && budget > 0 ? float(rates / double(budget)) : 0.0f;
        std::sort(m_budgeted.begin(), m_budgeted.end(), [](const Candidate& a, const Candidate& b) {
            return a.error != b.error ? a.error > b.error : a.work < b.work;
        });
        for (const Candidate& candidate : m_budgeted) {
            granted += stripAnchors(candidate.work / kStripsPerGroup, candidate.work % kStripsPerGroup);
            if (granted > budget)
                break;
            m_work[candidate.work].eye[e].decode = true;
        }
    }
}

} // namespace gsc
