// SPDX-License-Identifier: Apache-2.0
// What --reuse decides about a strip, once for the CPU and the GPU (runtime/reuse/reuse.md): how far off what is kept may be,
// where to decode it from, and what comes first where a budget is short. `change(c0, c1)` is the caller's: the largest
// predictedChange() of the anchors in question for a camera that goes from c0 to c1, +infinity where it cannot be told.
#pragma once

#include "kernels/reuse/reuse_math.h"

namespace gsc {

constexpr uint32_t kMust = ~0u;        // bucket of what is decoded whatever the budget
constexpr uint32_t kUrgencies = 4096;  // buckets, most urgent first: 256 per octave of predicted change
constexpr uint32_t kSplits = 1u << 14; // strips of one bucket of urgency, in an order of the frame's own

// An entry of one key is decoded for where the camera will be when half its life is over: the error then starts below
// the bound, falls to zero and rises again. It starts at this share of the bound.
constexpr float kLeadShare = 0.7f;
constexpr float kMaxLeadFrames = 64;
// Single keys that replace others are spread by what the first ones of their strips were spread by, and need little more.
constexpr float kLaterSpread = 0.15f;
constexpr float kGross = 0.1f; // a change that shows as much as a hole does, such as that of a view long left

// How the camera of an eye moves (runtime/view/camera_motion.h).
struct EyeMotion {
    float center[3] = {}, step[3] = {}; // world units; the step is that since the last frame
    float bend = 0;                     // how far the last step went aside from where it pointed, as a share of it
    bool steady = false;                // the motion is much like that of the frame before
    bool erratic = false;               // it moves, and not so
};

// Shares that depend on how entries are kept; all else is the same.
struct ReuseTuning {
    // Between two keys the change predicted from one to the other is all there but for this share, in the middle.
    float curve;
    // Of the bound: what the curve between two new keys may take; the rest is for a camera beside their line.
    float fill;
    // Of the bound, for a camera that goes another way in every frame: an error may then change its sign from one frame to
    // the next, and flickers by twice itself.
    float erratic;
    // Of the bound, for what a first frame decoded: it has one key and changes with every step of the camera.
    float fresh;
    // By how much of the bound strips of two keys differ, so that those of one age are not all due in one frame.
    float spread;
};
// A refresh goes on from the last key, and broadShare() holds to less what is close by and would flicker: a CPU.
constexpr ReuseTuning kGoesOn = {0.07f, 0.9f, 1.0f, 1.0f, 0.15f};
// A refresh decodes both keys, which must not come due half-way, `fill` of the bound off, and no cover is known: CUDA.
// Curves are measured on four trained models and the paths of gsc sample paths.
constexpr ReuseTuning kAnew = {0.08f, 0.7f, 0.5f, 0.5f, 0.3f};

// What ReusePolicy::Error decides a frame by.
struct ReuseRule {
    float bound = 0;            // 1 = full scale
    uint64_t decode_budget = 0; // anchors of a frame and eye, 0 = all that are due
    ReuseTuning tuning = {};
    EyeMotion eye[kMaxEyes];
};

// ReuseOptions::bound is in units of 1/255. A budget is of ReusePolicy::Error alone: by age all are equally urgent.
inline ReuseRule reuseRule(const ReuseOptions& reuse, const EyeMotion (&eyes)[kMaxEyes], const ReuseTuning& tuning)
{
    const uint64_t budget = reuse.policy == ReusePolicy::Error ? reuse.decode_budget : 0;
    return {reuse.bound / 255.0f, budget, tuning, {eyes[0], eyes[1]}};
}

// ReusePolicy::Depth: may what frame `decoded` decoded be drawn in `frame`? `depth`: reuseDepth().
GSC_HD bool youngEnough(uint64_t frame, uint64_t decoded, uint32_t depth)
{
    return frame - decoded <= depth;
}

// Largest change that eye `e` may draw of a strip's `keys`, 1 = full scale. `cover`: see broadShare(); 0 where it is not
// known.
GSC_HD float allowedChange(const ReuseRule& rule, uint32_t e, uint32_t strip, const StripKeys& keys, float cover = 0)
{
    const float bound = rule.bound * broadShare(cover);
    if (!rule.eye[e].steady)
        return rule.eye[e].erratic ? rule.tuning.erratic * bound : bound;
    const float spread = stagger(strip);
    if (keys.count == 1 && keys.fresh != 0) // or the picture would jump when all of a first frame is due at once
        return bound * rule.tuning.fresh * spread;
    const float share = keys.count == 2 ? rule.tuning.spread : kLaterSpread;
    return bound * (1 - share + share * spread);
}

// How a strip's keys are drawn for a camera: at `t` between them, off by `error`, 1 = full scale.
struct KeptChange {
    float t, error;
};

template <typename Change>
GSC_HD KeptChange changeOf(const ReuseRule& rule, const StripKeys& keys, const float* camera, const Change& change)
{
    const KeyPlace at = placeBetween(keys, camera, rule.tuning.curve);
    return {at.t, change(at.point, camera) + at.curve};
}

// The same from above, for any of the anchors StripKeys::lanes, without looking at them.
GSC_HD KeptChange changeAtMost(const ReuseRule& rule, const StripKeys& keys, const float* camera)
{
    const KeyPlace at = placeBetween(keys, camera, rule.tuning.curve);
    return {at.t, changeBound(keys.reach, keys.center[1], at.point, camera) + at.curve};
}

// What the next frame changes if the camera goes on as it does.
struct Outlook {
    float rate;    // seen of the step itself
    float urgency; // of what is kept: an entry whose key lies ahead gets better by itself
};

template <typename Change>
GSC_HD Outlook outlookOf(const ReuseRule& rule, uint32_t e, const StripKeys& kept, const Change& change)
{
    const EyeMotion& motion = rule.eye[e];
    const float next[3] = {motion.center[0] + motion.step[0], motion.center[1] + motion.step[1],
                           motion.center[2] + motion.step[2]};
    return {change(next, motion.center), changeOf(rule, kept, next, change).error};
}

// A single key at `center`, world units, of the anchors `lanes`.
GSC_HD StripKeys keysAt(const float* center, uint32_t lanes, bool fresh)
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
GSC_HD float spanAhead(const ReuseTuning& tuning, float allowed, float level)
{
    return maxNumber(tuning.fill * allowed / tuning.curve, level);
}

// Change at which a single key starts, to pass by the camera half-way: `allowed` when its life begins and ends.
GSC_HD float halfLife(float allowed, float level)
{
    return maxNumber(kLeadShare * allowed, 0.5f * level);
}

// A place ahead on the camera's way where the change from here is `lead` or less, if that is `least` frames ahead or
// more. `rate`: Outlook. Else leaves `center` as it is and returns false.
template <typename Change>
GSC_HD bool placeAhead(const EyeMotion& motion, float rate, float lead, float least, const Change& change,
                       float* center)
{
    float frames = minNumber(lead / rate, kMaxLeadFrames);
    bool found = false;
    // note: the change is not linear in the motion close by; both attempts always, since a warp's lanes go together
    for (int attempt = 0; attempt < 2; ++attempt) {
        float ahead[3];
        for (int i = 0; i < 3; ++i)
            ahead[i] = motion.center[i] + frames * motion.step[i];
        const float error = change(ahead, motion.center);
        if (!found && frames >= least && error <= lead) {
            for (int i = 0; i < 3; ++i)
                center[i] = ahead[i];
            found = true;
        }
        frames *= 0.9f * lead / error;
    }
    return found;
}

// What is decoded whatever the budget: what nothing is kept of, and what is grossly wrong.
GSC_HD bool mustDecode(const ReuseRule& rule, bool kept, float error)
{
    return rule.decode_budget == 0 || !kept || !(error <= kGross);
}

// Buckets of the float's own bits, from 2^-16 up.
GSC_HD uint32_t urgencyBucket(float urgency)
{
    const int octaves = int(__builtin_bit_cast(uint32_t, maxNumber(urgency, 0.0f)) >> 15) - ((127 - 16) << 8);
    return kUrgencies - 1 - uint32_t(clampInt(octaves, 0, int(kUrgencies) - 1));
}

// Strips of one urgency in an order of the frame's own, so that none waits for ever behind others.
GSC_HD uint32_t splitOf(uint32_t strip, uint32_t frame)
{
    uint32_t mixed = strip * 2654435769u + frame * 2246822519u;
    mixed = (mixed ^ mixed >> 15) * 739982445u;
    return uint32_t(uint64_t(mixed) * kSplits >> 32);
}

// Change at which the budget has entries decoded again, 0 = it meets the bound: entries that all live until they change
// this much use the budget up exactly. `rates`: sum of Outlook::rate over the anchors that are due.
GSC_HD float budgetLevel(const ReuseRule& rule, uint64_t due, float rates)
{
    return due > rule.decode_budget && rule.decode_budget > 0 ? rates / float(rule.decode_budget) : 0.0f;
}

} // namespace gsc
