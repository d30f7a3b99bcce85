// SPDX-License-Identifier: Apache-2.0
// Decisions of ReusePolicy::Error about a strip, on a CPU (runtime/reuse/reuse.md): how far off its kept keys may be,
// where to decode it from, and which strips come first where a budget is short. `change(c0, c1)` is the caller's: the
// largest predictedChange() of the anchors in question for a camera that goes from c0 to c1, +infinity where it cannot
// be told.
#pragma once

#include "kernels/reuse/reuse_math.h"

namespace gsc {

constexpr uint32_t kUrgencies = 4096;  // buckets, most urgent first: 256 per octave of predicted change
constexpr uint32_t kSplits = 1u << 14; // strips of one bucket of urgency, in an order of the frame's own

// An entry of one key is decoded for where the camera will be when half its life is over: the error then starts below
// the bound, falls to zero and rises again. It starts at this share of the bound.
constexpr float kLeadShare = 0.7f;
constexpr float kMaxLeadFrames = 64;
// Share of the bound that the curve between two keys may take; the rest is for a camera beside their line.
constexpr float kFill = 0.9f;
// Share of the bound by which strips differ, so that those of one age are not all due in one frame.
constexpr float kSpread = 0.15f;
constexpr float kGross = 0.1f; // a change that shows as much as a hole does, such as that of a view long left

// How the camera of an eye moves (runtime/view/camera_motion.h).
struct EyeMotion {
    float center[3] = {}, step[3] = {}; // world units; the step is that since the last frame
    float bend = 0;      // deviation of the last step from the direction of the one before, as a share of its length
    bool steady = false; // the motion is much like that of the frame before
};

// Inputs of the decisions of one frame.
struct ReuseRule {
    float bound = 0;            // 1 = full scale
    uint64_t decode_budget = 0; // anchors of a frame and eye, 0 = all that are due
    EyeMotion eye[kMaxEyes];
};

// ReuseOptions::bound is in units of 1/255. A budget is of ReusePolicy::Error alone: by age all are equally urgent.
inline ReuseRule reuseRule(const ReuseOptions& reuse, const EyeMotion (&eyes)[kMaxEyes])
{
    const uint64_t budget = reuse.policy == ReusePolicy::Error ? reuse.decode_budget : 0;
    return {reuse.bound / 255.0f, budget, {eyes[0], eyes[1]}};
}

// Largest change that eye `e` may draw of a strip's `keys`, 1 = full scale. `cover`: see broadShare(); 0 where it is not
// known.
inline float allowedChange(const ReuseRule& rule, uint32_t e, uint32_t strip, const StripKeys& keys, float cover = 0)
{
    const float bound = rule.bound * broadShare(cover);
    if (!rule.eye[e].steady)
        return bound;
    const float spread = stagger(strip);
    // else all strips of a first frame would be due in one frame, and the picture would jump
    if (keys.count == 1 && keys.fresh != 0)
        return bound * spread;
    return bound * (1 - kSpread + kSpread * spread);
}

// How a strip's keys are drawn for a camera: at `t` between them, off by `error`, 1 = full scale.
struct KeptChange {
    float t, error;
};

template <typename Change>
inline KeptChange changeOf(const StripKeys& keys, const float* camera, const Change& change)
{
    const KeyPlace at = placeBetween(keys, camera);
    return {at.t, change(at.point, camera) + at.curve};
}

// Upper bound of changeOf() for any of the anchors StripKeys::lanes, without looking at them.
inline KeptChange changeAtMost(const StripKeys& keys, const float* camera)
{
    const KeyPlace at = placeBetween(keys, camera);
    return {at.t, changeBound(keys.reach, keys.center[1], at.point, camera) + at.curve};
}

// Changes in the next frame if the camera goes on as it does, 1 = full scale.
struct Outlook {
    float rate;    // seen of the step itself
    float urgency; // urgency of decoding it again: an entry whose key lies ahead gets better by itself
};

template <typename Change>
inline Outlook outlookOf(const ReuseRule& rule, uint32_t e, const StripKeys& kept, const Change& change)
{
    const EyeMotion& motion = rule.eye[e];
    const float next[3] = {motion.center[0] + motion.step[0], motion.center[1] + motion.step[1],
                           motion.center[2] + motion.step[2]};
    return {change(next, motion.center), changeOf(kept, next, change).error};
}

// A single key at `center`, world units, of the anchors `lanes`.
inline StripKeys keysAt(const float* center, uint32_t lanes, bool fresh)
{
    StripKeys keys{};
    for (int i = 0; i < 3; ++i)
        keys.center[0][i] = keys.center[1][i] = center[i];
    keys.lanes = uint16_t(lanes);
    keys.count = 1;
    keys.fresh = fresh ? 1 : 0;
    return keys;
}

// Change that two keys are to span: until the curve between them takes its fill of what is `allowed` or, where that is
// more, as long as the budget makes entries live, `level` (budgetLevel()).
inline float spanAhead(float allowed, float level)
{
    return maxNumber(kFill * allowed / kCurve, level);
}

// Change at which a single key starts, to pass by the camera half-way: `allowed` when its life begins and ends.
inline float halfLife(float allowed, float level)
{
    return maxNumber(kLeadShare * allowed, 0.5f * level);
}

// A place ahead on the camera's way where the change from here is `lead` or less, if that is `least` frames ahead or
// more. `rate`: Outlook. Else leaves `center` as it is and returns false.
template <typename Change>
inline bool placeAhead(const EyeMotion& motion, float rate, float lead, float least, const Change& change,
                       float* center)
{
    float frames = minNumber(lead / rate, kMaxLeadFrames);
    bool found = false;
    // note: the change is not linear in the motion close by
    for (int attempt = 0; attempt < 2 && !found; ++attempt) {
        float ahead[3];
        for (int i = 0; i < 3; ++i)
            ahead[i] = motion.center[i] + frames * motion.step[i];
        const float error = change(ahead, motion.center);
        if (frames >= least && error <= lead) {
            for (int i = 0; i < 3; ++i)
                center[i] = ahead[i];
            found = true;
        }
        frames *= 0.9f * lead / error;
    }
    return found;
}

// True if a strip must be decoded whatever the budget: without a budget every due strip; else a strip without an entry,
// or with one that is grossly wrong.
inline bool mustDecode(const ReuseRule& rule, bool kept, float error)
{
    return rule.decode_budget == 0 || !kept || !(error <= kGross);
}

// Buckets of the float's own bits, from 2^-16 up.
inline uint32_t urgencyBucket(float urgency)
{
    const int octaves = int(__builtin_bit_cast(uint32_t, maxNumber(urgency, 0.0f)) >> 15) - ((127 - 16) << 8);
    return kUrgencies - 1 - uint32_t(clampInt(octaves, 0, int(kUrgencies) - 1));
}

// Strips of one urgency in an order of the frame's own, so that none waits for ever behind others.
inline uint32_t splitOf(uint32_t strip, uint32_t frame)
{
    uint32_t mixed = strip * 2654435769u + frame * 2246822519u;
    mixed = (mixed ^ mixed >> 15) * 739982445u;
    return uint32_t(uint64_t(mixed) * kSplits >> 32);
}

// Change at which the budget has entries decoded again, 0 = it meets the bound: entries that all live until they change
// this much use the budget up exactly. `rates`: sum of Outlook::rate over the anchors that are due.
inline float budgetLevel(const ReuseRule& rule, uint64_t due, float rates)
{
    return due > rule.decode_budget && rule.decode_budget > 0 ? rates / float(rule.decode_budget) : 0.0f;
}

} // namespace gsc
