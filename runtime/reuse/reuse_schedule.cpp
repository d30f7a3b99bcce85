// SPDX-License-Identifier: Apache-2.0
// Scheduling of CpuReuse by the rules of policy.h: decides which strips are drawn from entries, which are decoded, and
// in which order the budget is spent.
#include "runtime/reuse/reuse_cpu.h"

#include "runtime/backend/frame_checks.h"

#include <algorithm>
#include <cmath>

namespace gsc {

namespace {

uint32_t lanesOf(const GroupMask& mask, uint32_t eye, uint32_t strip)
{
    constexpr uint32_t kPerWord = 64 / kStripAnchors;
    return uint32_t(mask.visible[eye][strip / kPerWord] >> (strip % kPerWord * kStripAnchors)) & 0xffffu;
}

} // namespace

// A strip whose anchors are loaded from the model only when they are needed.
struct CpuReuse::LazyStrip {
    const ModelView& model;
    const uint16_t* sensitivity;
    const GroupRecord& group;
    uint32_t strip; // index of the strip in the group
    uint32_t id;
    bool loaded;
    StripAnchors loaded_anchors;

    const StripAnchors& anchors()
    {
        if (!loaded)
            loadStripAnchors(model, sensitivity, group, strip, loaded_anchors);
        loaded = true;
        return loaded_anchors;
    }
    // Returns the function `change` that policy.h wants, for the anchors in the bit mask `lanes`.
    auto changeOf(uint32_t lanes)
    {
        return [this, lanes](const float* c0, const float* c1) { return stripError(anchors(), lanes, c0, c1); };
    }
};

// Returns the share of this frame's visible anchors that are new, and notes the visible anchors for the next frame.
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
    return gsc::updateRate(fresh, visible);
}

// Returns the keys of an entry for drawing the anchors `lanes`. The span counts only anchors seen so far: an unseen
// one that the camera passes closely changes so fast that the whole strip would be decoded every other frame.
const StripKeys& CpuReuse::widened(uint32_t slot, LazyStrip& strip, uint32_t lanes)
{
    StripKeys& keys = m_cache.entry(slot).keys;
    const uint32_t more = lanes & ~uint32_t(keys.lanes);
    if (more != 0 && keys.count == 2)
        keys.span = std::max(keys.span, strip.changeOf(more)(keys.center[0], keys.center[1]));
    keys.lanes = uint16_t(keys.lanes | more);
    return keys;
}

// Moves the second of `keys` ahead on the way of eye `e`, so far that the predicted error from the first key to it is
// `target`, if one frame adds `rate`. If the way bends, it stays nearer: half way between the keys, the camera is off
// the straight line by an eighth of the bend times the square of the frames, which adds to the error. Returns the
// number of frames ahead.
float CpuReuse::leadKey(LazyStrip& strip, uint32_t e, float rate, float target, StripKeys& keys) const
{
    const EyeMotion& motion = m_rule.eye[e];
    float way = 0, pace = 0;
    for (int i = 0; i < 3; ++i) {
        const float gone = motion.center[i] - keys.center[0][i];
        way += gone * gone;
        pace += motion.step[i] * motion.step[i];
    }
    const float behind = std::sqrt(way / pace); // frames since the first key
    // solves rate * (frames + bend * frames^2) = target for frames
    const float bend = motion.bend / (8 * kCurve);
    const auto framesFor = [&](float each) {
        const float all = 2 * target / (each + std::sqrt(each * (each + 4 * target * bend)));
        return std::min(all - behind, kMaxLeadFrames);
    };
    float frames = framesFor(rate);
    for (int attempt = 0; attempt < 2; ++attempt) {
        for (int i = 0; i < 3; ++i)
            keys.center[1][i] = motion.center[i] + frames * motion.step[i];
        keys.span = strip.changeOf(keys.lanes)(keys.center[0], keys.center[1]);
        if (attempt == 0) // near the camera the change is not linear in the motion, so try once more
            frames = framesFor(keys.span / (frames + behind));
    }
    return frames;
}

// Plans the keys for decoding a strip. The new key lies ahead on the camera's way, so that the entry is drawn between
// it and the last key. If there is no last key, or the camera has left the line, the new key lies half of an entry's
// life ahead. The distance is as large as the bound allows or, if that is more, what the budget makes entries live.
// `seen`: anchors that any eye sees.
StripKeys CpuReuse::planFor(LazyStrip& strip, uint32_t e, const EyeWork& eye, uint32_t seen, float cover) const
{
    const EyeMotion& motion = m_rule.eye[e];
    const uint32_t own = m_cache.find(strip.id, e);
    StripKeys plan = keysAt(motion.center, seen, own == kNoSlot);
    const auto change = strip.changeOf(eye.lanes);
    if (motion.steady) {
        // a strip without an entry is decoded whatever the budget is, and its change does not matter
        const float level = own != kNoSlot && m_rule.decode_budget > 0 ? m_level[e] : 0.0f;
        const float half = halfLife(allowedChange(m_rule, e, strip.id, plan, cover), level);
        StripKeys keys = plan;
        if (own != kNoSlot) {
            std::copy_n(m_cache.entry(own).keys.center[1], 3, keys.center[0]);
            keys.count = 2;
        }
        const float allowed = allowedChange(m_rule, e, strip.id, keys, cover);
        if (own != kNoSlot && leadKey(strip, e, eye.outlook.rate, spanAhead(allowed, level), keys) >= 1 &&
            changeOf(keys, motion.center, change).error <= std::max(allowed, 0.5f * half))
            plan = keys;
        else if (placeAhead(motion, eye.outlook.rate, half, 0.5f, change, plan.center[0]))
            std::copy_n(plan.center[0], 3, plan.center[1]);
    }
    plan.reach = stripReach(strip.anchors(), plan.center[1]);
    return plan;
}

// Chooses the eye's own entry, if there is one. Returns true if its predicted error is small enough.
bool CpuReuse::chooseOwn(LazyStrip& strip, uint32_t e, uint32_t seen, float cover, EyeWork& eye)
{
    eye.slot = m_cache.find(strip.id, e);
    if (eye.slot == kNoSlot)
        return false;
    const StripKeys& keys = widened(eye.slot, strip, seen);
    const float* const camera = m_rule.eye[e].center;
    const float allowed = allowedChange(m_rule, e, strip.id, keys, cover);
    eye.drawn = changeAtMost(keys, camera);
    if (!(eye.drawn.error <= allowed))
        eye.drawn = changeOf(keys, camera, strip.changeOf(eye.lanes));
    return eye.drawn.error <= allowed;
}

// Chooses the other eye's entry if its predicted error is smaller. Returns true if that is small enough.
bool CpuReuse::chooseOther(LazyStrip& strip, uint32_t e, uint32_t seen, float cover, EyeWork& eye)
{
    const uint32_t other = m_cache.find(strip.id, 1 - e);
    if (other == kNoSlot)
        return false;
    const StripKeys& keys = widened(other, strip, seen);
    const KeptChange there = changeOf(keys, m_rule.eye[e].center, strip.changeOf(eye.lanes));
    if (!(there.error < eye.drawn.error))
        return false;
    eye.slot = other;
    eye.drawn = there;
    return there.error <= allowedChange(m_rule, e, strip.id, keys, cover);
}

// Decides for a strip which entry each eye draws, and which is due. An eye may draw the other eye's entry unless that
// is due itself; the right eye may draw what the left one decodes.
void CpuReuse::scheduleByError(uint32_t eye_count, LazyStrip& strip, StripWork& work)
{
    const uint32_t seen = work.eye[0].lanes | work.eye[1].lanes;
    float cover = 0; // largest share of the picture that a Gaussian of the strip covered when it was last drawn
    for (uint32_t e = 0; e < eye_count; ++e)
        if (const uint32_t slot = m_cache.find(strip.id, e); slot != kNoSlot)
            cover = std::max(cover, m_cache.entry(slot).cover);
    bool stays[kMaxEyes] = {true, true}; // the eye's own entry is good enough, so the other eye may draw it, too
    for (uint32_t e = 0; e < eye_count; ++e)
        stays[e] = work.eye[e].lanes == 0 || chooseOwn(strip, e, seen, cover, work.eye[e]);
    for (uint32_t e = 0; e < eye_count; ++e) {
        EyeWork& eye = work.eye[e];
        const bool other = !stays[e] && eye_count > 1 && chooseOther(strip, e, seen, cover, eye);
        eye.due = !stays[e] && !(other && stays[1 - e]);
        if (eye.due && (m_rule.eye[e].steady || m_rule.decode_budget > 0))
            eye.outlook = outlookOf(m_rule, e, eye.slot != kNoSlot ? m_cache.entry(eye.slot).keys : StripKeys{},
                                    strip.changeOf(eye.lanes));
    }
    EyeWork &left = work.eye[0], &right = work.eye[1];
    if (left.due)
        left.plan = planFor(strip, 0, left, seen, cover);
    if (left.due && right.due &&
        changeOf(left.plan, m_rule.eye[1].center, strip.changeOf(right.lanes)).error <=
            allowedChange(m_rule, 1, strip.id, left.plan, cover)) {
        right.due = false;
        right.shares = true;
        left.outlook.urgency = std::max(left.outlook.urgency, right.outlook.urgency);
        left.drawn.error = std::max(left.drawn.error, right.drawn.error);
    }
    if (right.due)
        right.plan = planFor(strip, 1, right, seen, cover);
}

// Decides by age which strips are due. If the eyes are merged, as in the GS-Cache paper, eye 0 owns the entry, whether
// or not it sees the strip.
void CpuReuse::scheduleByDepth(const ReuseFrame& frame, uint32_t id, StripWork& work)
{
    float middle[3];
    if (m_merged)
        mergedCenter(frame.eyes, middle);
    for (uint32_t e = 0; e < frame.eye_count; ++e) {
        EyeWork& eye = work.eye[e];
        if (!m_merged && eye.lanes == 0)
            continue;
        eye.slot = m_cache.find(id, m_merged ? 0 : e);
        const bool due = eye.slot == kNoSlot || !youngEnough(m_frame, m_cache.entry(eye.slot).decoded, m_depth);
        eye.shares = due && m_merged && e == 1;
        eye.due = due && !eye.shares;
        eye.plan = keysAt(m_merged ? middle : frame.eyes[e].center, eye.lanes, eye.slot == kNoSlot);
    }
}

void CpuReuse::scheduleBlock(const ReuseFrame& frame, size_t block)
{
    const GroupRecord& group = m_model.groups[m_groups[block]];
    const GroupMask& mask = frame.selected.groups[m_candidates[block]];
    for (uint32_t s = 0; s < kStripsPerGroup; ++s) {
        StripWork& work = m_work[block * kStripsPerGroup + s];
        work = {};
        for (uint32_t e = 0; e < frame.eye_count; ++e)
            work.eye[e].lanes = uint16_t(lanesOf(mask, e, s));
        if ((work.eye[0].lanes | work.eye[1].lanes) == 0)
            continue;
        LazyStrip strip{m_model, sensitivity(), group, s, stripId(block * kStripsPerGroup + s), false, {}};
        if (m_policy == ReusePolicy::Error)
            scheduleByError(frame.eye_count, strip, work);
        else
            scheduleByDepth(frame, strip.id, work);
        for (uint32_t e = 0; e < frame.eye_count; ++e) {
            EyeWork& eye = work.eye[e];
            // marks as used: the entry that is drawn, and the one whose last key the plan may need
            for (const uint32_t slot : {eye.due ? m_cache.find(strip.id, e) : kNoSlot, eye.slot})
                if (slot != kNoSlot) {
                    m_cache.entry(slot).used = m_frame;
                    eye.extent = m_cache.entry(slot).extent;
                }
        }
    }
}

// Grants decodes of due strips: all that must be decoded, then those with the largest changes, within the budget.
void CpuReuse::grant(const ReuseFrame& frame)
{
    for (uint32_t e = 0; e < frame.eye_count; ++e) {
        m_budgeted.clear();
        uint64_t granted = 0, due = 0;
        double rates = 0;
        for (uint32_t w = 0; w < m_work.size(); ++w) {
            EyeWork& eye = m_work[w].eye[e];
            if (!eye.due)
                continue;
            eye.decode = mustDecode(m_rule, eye.slot != kNoSlot, eye.drawn.error);
            const uint32_t anchors = stripAnchors(w / kStripsPerGroup, w % kStripsPerGroup);
            due += anchors;
            if (eye.decode)
                granted += anchors;
            else
                m_budgeted.push_back({urgencyBucket(eye.outlook.urgency), splitOf(stripId(w), uint32_t(m_frame)), w});
            // with a camera on an anchor the rate is infinite, and would make the sum useless
            if (eye.outlook.rate < INFINITY)
                rates += double(eye.outlook.rate) * anchors;
        }
        m_level[e] = budgetLevel(m_rule, due, float(rates));
        std::sort(m_budgeted.begin(), m_budgeted.end());
        for (const Candidate& candidate : m_budgeted) {
            granted += stripAnchors(candidate.work / kStripsPerGroup, candidate.work % kStripsPerGroup);
            if (granted > m_rule.decode_budget)
                break;
            m_work[candidate.work].eye[e].decode = true;
        }
    }
}

} // namespace gsc
