// SPDX-License-Identifier: Apache-2.0
// The half of CpuReuse that decides: what is drawn again, what is decoded, and in which order within the budget.
#include "runtime/reuse/reuse_cpu.h"

#include "runtime/frame_checks.h"
#include "kernels/math/anchor.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

namespace gsc {

namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();

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

// Anchors of a group, loaded strip by strip where something must be known of them.
struct CpuReuse::LazyAnchors {
    const ModelView& model;
    const uint16_t* sensitivity;
    const GroupRecord& group;
    GroupAnchors anchors;
    uint32_t loaded = 0;

    LazyAnchors(const ModelView& of, const uint16_t* halves, const GroupRecord& record)
        : model(of), sensitivity(halves), group(record)
    {
    }
    const GroupAnchors& with(uint32_t strip)
    {
        if (!(loaded >> strip & 1))
            loadStripAnchors(model, sensitivity, group, strip, anchors);
        loaded |= 1u << strip;
        return anchors;
    }
};

// That of this frame, and what it saw for the next.
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

// For drawing the anchors `lanes`. The span is of those that were seen so far: what passes beside the camera, unseen,
// changes so fast that it would have its whole strip decoded every other frame.
CpuReuse::Keys CpuReuse::keysOf(uint32_t slot, LazyAnchors& anchors, uint32_t strip, uint32_t lanes)
{
    CacheEntry& entry = m_cache.entry(slot);
    if (const uint32_t more = lanes & ~uint32_t(entry.lanes); entry.keys == 2 && more != 0) {
        const float span = stripError(anchors.with(strip), strip, more, entry.center[0], entry.center[1]);
        entry.span = std::max(entry.span, span);
        entry.lanes = uint16_t(entry.lanes | more);
    }
    Keys keys;
    std::memcpy(keys.center, entry.center, sizeof(keys.center));
    keys.span = entry.span;
    keys.reach = entry.reach;
    keys.count = entry.keys;
    keys.lanes = entry.lanes;
    return keys;
}

// The point of the keys' line next to the camera, and what the camera's distance from it and the curve of the change
// between the keys add up to; where a bound of that is not above `enough`, the bound.
CpuReuse::Place CpuReuse::place(const Keys& keys, LazyAnchors& anchors, uint32_t strip, uint32_t lanes,
                                const float* now, float enough)
{
    const KeyPlace at = placeBetween(keys.center, keys.count, keys.span, now, kCurveOfRest);
    const float bound =
        enough > at.curve ? changeBound(keys.reach, keys.center[keys.count - 1], at.point, now) + at.curve : 0.0f;
    if (enough > at.curve && bound <= enough)
        return {at.t, bound};
    return {at.t, stripError(anchors.with(strip), strip, lanes, at.point, now) + at.curve};
}

// Puts the second of `keys` ahead on the way of eye `e`, so far that `target` is the change from the first to it, where
// a step changes `rate`. Nearer if the way bends: half way the camera is an eighth of the bend times the square of the
// frames off the line, which adds to the curve between the keys. Returns how many frames ahead.
float CpuReuse::leadKey(LazyAnchors& anchors, uint32_t strip, uint32_t e, float rate, float target, Keys& keys) const
{
    const float *now = m_motion.center(e), *step = m_motion.step(e);
    float way = 0, pace = 0;
    for (int i = 0; i < 3; ++i) {
        way += (now[i] - keys.center[0][i]) * (now[i] - keys.center[0][i]);
        pace += step[i] * step[i];
    }
    const float behind = std::sqrt(way / pace); // frames
    // the frames at which rate * (frames + bend * frames^2) is the target
    const float bend = m_motion.bend(e) / (8 * kCurveOfRest);
    const auto framesFor = [&](float each) {
        const float all = 2 * target / (each + std::sqrt(each * (each + 4 * target * bend)));
        return std::min(all - behind, kMaxLeadFrames);
    };
    float frames = framesFor(rate);
    for (int attempt = 0; attempt < 2; ++attempt) {
        for (int i = 0; i < 3; ++i)
            keys.center[1][i] = now[i] + frames * step[i];
        keys.span = stripError(anchors.with(strip), strip, keys.lanes, keys.center[0], keys.center[1]);
        if (attempt == 0) // the change is not linear in the motion close by
            frames = framesFor(keys.span / (frames + behind));
    }
    return frames;
}

// Of the bound that is left to every eye there is, from what was drawn of the strip last.
float CpuReuse::allowedShare(uint64_t strip_id, uint32_t eye_count) const
{
    float cover = 0;
    for (uint32_t e = 0; e < eye_count; ++e)
        if (const uint32_t slot = m_cache.find(strip_id, e); slot != kNoSlot)
            cover = std::max(cover, m_cache.entry(slot).cover);
    return broadShare(cover);
}

// What to decode, if `work` is decoded: a key ahead on the camera's way, so that the entry is drawn between it and its
// last one; without one, or where the camera has left the line, a single key half a life ahead. How far: as the bound
// allows or, where that is more, as long as the budget makes entries live.
void CpuReuse::choosePlan(const ReuseFrame& frame, LazyAnchors& anchors, uint32_t strip, uint64_t strip_id, uint32_t e,
                          StripWork& strip_work)
{
    EyeWork& work = strip_work.eye[e];
    const float* now = frame.eyes[e].center;
    work.plan = {};
    work.plan.count = 1;
    std::copy_n(now, 3, work.plan.center[0]);
    work.planned = {0, 0};
    work.urgency = work.place.error;
    if (frame.options.reuse.policy != ReusePolicy::Error || m_motion.history(e) < 2)
        return;
    float next[3];
    for (int i = 0; i < 3; ++i)
        next[i] = now[i] + m_motion.step(e)[i];
    work.rate = stripError(anchors.with(strip), strip, work.lanes, next, now);
    if (work.slot != kNoSlot) // an entry whose key lies ahead gets better by itself
        work.urgency = place(keysOf(work.slot, anchors, strip, work.lanes), anchors, strip, work.lanes, next).error;
    if (!m_motion.steady(e))
        return;
    const uint32_t own = m_cache.find(strip_id, e);
    const float bound = tolerance(frame.options.reuse) * allowedShare(strip_id, frame.eye_count);
    // what is new is decoded whatever the budget, and no better for being far off
    const float level = own != kNoSlot && frame.options.reuse.decode_budget > 0 ? m_level[e] : 0.0f;
    const float half = std::max(kLeadShare * bound, 0.5f * level);
    const float target = std::max(kCurveFill * refreshShare(strip_id) * bound / kCurveOfRest, level);
    Keys keys;
    keys.count = 2;
    keys.lanes = strip_work.eye[0].lanes | strip_work.eye[1].lanes; // the other eye may draw it, too
    if (own != kNoSlot) {
        const CacheEntry& old = m_cache.entry(own);
        std::copy_n(old.center[old.keys - 1], 3, keys.center[0]);
        if (leadKey(anchors, strip, e, work.rate, target, keys) >= 1) {
            const Place drawn = place(keys, anchors, strip, work.lanes, now);
            if (drawn.error <= std::max(bound, 0.5f * half)) {
                work.plan = keys;
                work.planned = drawn;
                return;
            }
        }
    }
    float frames = std::min(half / work.rate, kMaxLeadFrames);
    // note: the change is not linear in the motion close by
    for (int attempt = 0; attempt < 2 && frames > 0.5f; ++attempt) {
        float ahead[3];
        for (int i = 0; i < 3; ++i)
            ahead[i] = now[i] + frames * m_motion.step(e)[i];
        const float error = stripError(anchors.with(strip), strip, work.lanes, ahead, now);
        if (error <= half) {
            std::copy_n(ahead, 3, work.plan.center[0]);
            work.planned.error = error;
            return;
        }
        frames *= 0.9f * half / error;
    }
}

void CpuReuse::plan(const ReuseFrame& frame, LazyAnchors& anchors, uint32_t strip, uint64_t strip_id, uint32_t e,
                    StripWork& strip_work)
{
    choosePlan(frame, anchors, strip, strip_id, e, strip_work);
    EyeWork& work = strip_work.eye[e];
    if (frame.options.reuse.policy == ReusePolicy::Error)
        work.plan.reach = stripReach(anchors.with(strip), strip, work.plan.center[work.plan.count - 1]);
}

void CpuReuse::scheduleEye(const ReuseFrame& frame, LazyAnchors& anchors, uint32_t strip, uint64_t strip_id, uint32_t e,
                           StripWork& work)
{
    const bool by_error = frame.options.reuse.policy == ReusePolicy::Error;
    float most = by_error ? tolerance(frame.options.reuse) : float(m_depth);
    const float* now = frame.eyes[e].center;
    EyeWork& eye = work.eye[e];
    eye.slot = m_cache.find(strip_id, e);
    eye.place.error = kInfinity;
    if (by_error)
        most *= allowedShare(strip_id, frame.eye_count);
    // what a first frame decoded would be due all at once, and the picture would jump
    if (by_error && eye.slot != kNoSlot && m_motion.steady(e))
        most *= m_cache.entry(eye.slot).keys == 1 ? stagger(strip_id) : refreshShare(strip_id);
    if (eye.slot != kNoSlot)
        eye.place = by_error ? place(keysOf(eye.slot, anchors, strip, eye.lanes), anchors, strip, eye.lanes, now, most)
                             : Place{0, float(m_frame - m_cache.entry(eye.slot).decoded)};
    if (by_error && frame.eye_count > 1 && !(eye.place.error <= most)) {
        const bool replaced = e == 1 && work.eye[0].due; // then the left eye's entry is not what it was
        const uint32_t other = m_cache.find(strip_id, 1 - e);
        if (other != kNoSlot && !replaced) {
            const Place there = place(keysOf(other, anchors, strip, eye.lanes), anchors, strip, eye.lanes, now);
            if (there.error < eye.place.error) {
                eye.place = there;
                eye.slot = other;
            }
        }
        if (replaced) {
            eye.shared = place(work.eye[0].plan, anchors, strip, eye.lanes, now);
            eye.shares = eye.shared.error <= most;
            // without the budget for it the left eye's entry stays as it is, for both
            const bool may_stay = frame.options.reuse.decode_budget > 0 || (eye.shares && eye.slot == kNoSlot);
            if (may_stay && other != kNoSlot) {
                Place there = place(keysOf(other, anchors, strip, eye.lanes), anchors, strip, eye.lanes, now);
                there.error = eye.shares ? there.error : std::max(there.error, eye.shared.error);
                if (there.error < eye.place.error || eye.slot == kNoSlot) {
                    eye.slot = other;
                    eye.place = there;
                }
            }
        }
    }
    eye.due = !(eye.place.error <= most) && !eye.shares;
    if (eye.due)
        plan(frame, anchors, strip, strip_id, e, work);
}

void CpuReuse::scheduleStrip(const ReuseFrame& frame, LazyAnchors& anchors, uint32_t strip, uint64_t strip_id,
                             StripWork& work)
{
    for (uint32_t e = 0; e < frame.eye_count; ++e)
        if (work.eye[e].lanes != 0)
            scheduleEye(frame, anchors, strip, strip_id, e, work);
    // an entry that this frame replaces is nobody else's any more
    EyeWork& left = work.eye[0];
    if (work.eye[1].due && left.lanes != 0 && !left.due && m_cache.entry(left.slot).eye == 1) {
        left.due = true;
        if (frame.options.reuse.policy == ReusePolicy::Error) // of which no more than a bound may be known
            left.place =
                place(keysOf(left.slot, anchors, strip, left.lanes), anchors, strip, left.lanes, frame.eyes[0].center);
        plan(frame, anchors, strip, strip_id, 0, work);
    }
    for (uint32_t e = 0; e < frame.eye_count; ++e) {
        EyeWork& eye = work.eye[e];
        const auto use = [&](uint32_t slot) {
            m_cache.entry(slot).used = m_frame;
            eye.extent = m_cache.entry(slot).extent;
        };
        if (eye.slot != kNoSlot)
            use(eye.slot);
        if (const uint32_t own = m_cache.find(strip_id, e); eye.due && own != kNoSlot)
            use(own); // the plan may need its last key
    }
}

// The GS-Cache paper's depth with its one decode for both eyes: an entry per strip, decoded from the middle between the
// eyes, drawn by both.
void CpuReuse::scheduleMerged(const ReuseFrame& frame, uint64_t strip_id, StripWork& work)
{
    const uint32_t slot = m_cache.find(strip_id, 0);
    const float age = slot != kNoSlot ? float(m_frame - m_cache.entry(slot).decoded) : kInfinity;
    for (EyeWork& eye : work.eye) {
        eye.slot = slot;
        eye.place = {0, age};
    }
    if (slot != kNoSlot) {
        m_cache.entry(slot).used = m_frame;
        work.eye[0].extent = work.eye[1].extent = m_cache.entry(slot).extent;
    }
    EyeWork& left = work.eye[0]; // decodes, whether or not it sees the strip
    left.due = !(age <= float(m_depth));
    work.eye[1].shares = left.due;
    if (!left.due)
        return;
    left.plan.count = 1;
    mergedCenter(frame.eyes, left.plan.center[0]);
    left.urgency = age;
}

void CpuReuse::scheduleBlock(const ReuseFrame& frame, size_t block)
{
    const GroupRecord& group = m_model.groups[m_groups[block]];
    const GroupMask& mask = frame.selected.groups[m_candidates[block]];
    LazyAnchors anchors(m_model, sensitivity(), group);
    for (uint32_t s = 0; s < kStripsPerGroup; ++s) {
        StripWork& work = m_work[block * kStripsPerGroup + s];
        work = {};
        uint32_t seen = 0;
        for (uint32_t e = 0; e < frame.eye_count; ++e) {
            work.eye[e].lanes = uint16_t(lanesOf(mask, e, s));
            seen |= work.eye[e].lanes;
        }
        if (seen != 0 && m_merged)
            scheduleMerged(frame, uint64_t(m_groups[block]) * kStripsPerGroup + s, work);
        else if (seen != 0)
            scheduleStrip(frame, anchors, s, uint64_t(m_groups[block]) * kStripsPerGroup + s, work);
    }
}

// Of what is due, what the budget lets be decoded. What was never decoded always is, and what is grossly wrong.
// What is left of the budget goes to the largest changes.
void CpuReuse::grant(const ReuseFrame& frame)
{
    const uint64_t budget = frame.options.reuse.decode_budget;
    for (uint32_t e = 0; e < frame.eye_count; ++e) {
        m_budgeted.clear();
        uint64_t granted = 0, due = 0;
        double rates = 0;
        for (uint32_t w = 0; w < m_work.size(); ++w) {
            EyeWork& eye = m_work[w].eye[e];
            // what the left eye decodes is for the right one, too, where that shares it
            const EyeWork& right = m_work[w].eye[1];
            const float other_error = e == 0 && right.shares ? right.place.error : 0.0f;
            eye.decode =
                eye.due && (budget == 0 || eye.slot == kNoSlot || std::max(eye.place.error, other_error) > kGross);
            if (!eye.due)
                continue;
            const uint32_t anchors = stripAnchors(w / kStripsPerGroup, w % kStripsPerGroup);
            due += anchors;
            if (eye.decode)
                granted += anchors;
            else
                m_budgeted.push_back({std::max(eye.urgency, other_error), w});
            if (eye.rate < kInfinity) // a camera on an anchor changes everything at once
                rates += double(eye.rate) * anchors;
        }
        // entries that all live until they change this much use the budget up exactly
        m_level[e] = due > budget && budget > 0 ? float(rates / double(budget)) : 0.0f;
        std::sort(m_budgeted.begin(), m_budgeted.end(), [](const Candidate& a, const Candidate& b) {
            return a.urgency != b.urgency ? a.urgency > b.urgency : a.work < b.work;
        });
        for (const Candidate& candidate : m_budgeted) {
            granted += stripAnchors(candidate.work / kStripsPerGroup, candidate.work % kStripsPerGroup);
            if (granted > budget)
                break;
            m_work[candidate.work].eye[e].decode = true;
        }
    }
}

// An eye that draws the other's entry, which this frame replaces for the other eye: it draws the new one.
void CpuReuse::adoptPlans(const ReuseFrame& frame)
{
    for (size_t w = 0; w < m_work.size() && frame.eye_count > 1; ++w)
        for (uint32_t e = 0; e < frame.eye_count; ++e) {
            EyeWork& eye = m_work[w].eye[e];
            const EyeWork& other = m_work[w].eye[1 - e];
            if (eye.decode || eye.lanes == 0 || !other.decode || eye.slot == kNoSlot || eye.slot != other.slot)
                continue;
            LazyAnchors anchors{m_model, sensitivity(), m_model.groups[m_groups[w / kStripsPerGroup]]};
            eye.place = place(other.plan, anchors, uint32_t(w % kStripsPerGroup), eye.lanes, frame.eyes[e].center);
        }
}

} // namespace gsc
