// SPDX-License-Identifier: Apache-2.0
// Decisions of ReusePolicy::Error about a strip, on a CPU (runtime/reuse/reuse.md): how much its kept keys may be in
// error, from where it is decoded, and which strips are decoded first if the budget is too small. The caller supplies
// change(c0, c1): the largest predictedChange() of the anchors in question for a camera that moves from c0 to c1,
// +infinity if it is not known.
#pragma once

#include "kernels/reuse/reuse_math.h"

namespace gsc {

constexpr uint32_t kUrgencies = 4096; // buckets of urgency, the most urgent first: 256 per octave of predicted change
// number of subdivisions of a bucket of urgency, by which its strips get an order that differs from frame to frame
constexpr uint32_t kSplits = 1u << 14;

// A single key is decoded for the place where the camera will be when half of the entry's life is over: the error
// starts below the bound, falls to zero and rises again. It starts at this share of the bound.
constexpr float kLeadShare = 0.7f;
constexpr float kMaxLeadFrames = 64;
// Share of the bound that the curve between two keys may take; the rest is for a camera that is not on their line.
constexpr float kFill = 0.9f;
// Share of the bound by which strips' bounds differ, so that strips decoded in one frame are not all due in one frame.
constexpr float kSpread = 0.15f;
// a change as visible as a hole, such as in a strip kept from a place that the camera left long ago; 1 = full scale
constexpr float kGross = 0.1f;

// Motion of an eye's camera (runtime/view/camera_motion.h).
struct EyeMotion {
    float center[3] = {}, step[3] = {}; // world units: place of the camera, and its movement since the last frame
    // difference of the last step from the direction of the one before, as a share of the step's length
    float bend = 0;
    bool steady = false; // true if the motion is much like that of the frame before
};

// Values on which the decisions of one frame depend.
struct ReuseRule {
    float bound = 0;            // largest predicted change, 1 = full scale
    uint64_t decode_budget = 0; // most anchors to decode in a frame for an eye, 0 = all that are due
    EyeMotion eye[kMaxEyes];
};

// Rule of a frame. ReuseOptions::bound is in units of 1/255. Only ReusePolicy::Error has a budget, since by age all
// strips are equally urgent.
inline ReuseRule reuseRule(const ReuseOptions& reuse, const EyeMotion (&eyes)[kMaxEyes])
{
    const uint64_t budget = reuse.policy == ReusePolicy::Error ? reuse.decode_budget : 0;
    return {reuse.bound / 255.0f, budget, {eyes[0], eyes[1]}};
}

// Largest change, 1 = full scale, with which eye `e` may draw a strip from `keys`. `cover`: broadShare(); 0 = unknown.
inline float allowedChange(const ReuseRule& rule, uint32_t e, uint32_t strip, const StripKeys& keys, float cover = 0)
{
    const float bound = rule.bound * broadShare(cover);
    if (!rule.eye[e].steady)
        return bound;
    const float spread = stagger(strip);
    // spreads out the strips of a first frame: otherwise all are due in one frame, in which the picture would jump
    if (keys.count == 1 && keys.fresh != 0)
        return bound * spread;
    return bound * (1 - kSpread + kSpread * spread);
}

// How a strip is drawn from its keys for a camera: at place `t` between them, with a predicted error, 1 = full scale.
struct KeptChange {
    float t, error;
};

template <typename Change>
inline KeptChange changeOf(const StripKeys& keys, const float* camera, const Change& change)
{
    const KeyPlace at = placeBetween(keys, camera);
    return {at.t, change(at.point, camera) + at.curve};
}

// Upper bound of changeOf() for the anchors StripKeys::lanes, found without reading them.
inline KeptChange changeAtMost(const StripKeys& keys, const float* camera)
{
    const KeyPlace at = placeBetween(keys, camera);
    return {at.t, changeBound(keys.reach, keys.center[1], at.point, camera) + at.curve};
}

// Predicted changes in the next frame if the camera moves on as it does now, 1 = full scale.
struct Outlook {
    float rate; // change that the camera's step alone causes
    // error of the entry after the step, by which it is urgent to decode it again; that of an entry whose key lies
    // ahead falls by itself
    float urgency;
};

template <typename Change>
inline Outlook outlookOf(const ReuseRule& rule, uint32_t e, const StripKeys& kept, const Change& change)
{
    const EyeMotion& motion = rule.eye[e];
    const float next[3] = {motion.center[0] + motion.step[0], motion.center[1] + motion.step[1],
                           motion.center[2] + motion.step[2]};
    return {change(next, motion.center), changeOf(kept, next, change).error};
}

// Keys with a single one at `center`, world units, for the anchors `lanes`.
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

// Change that lies between two keys: such that the curve between them takes its share of what is `allowed` (kFill), or,
// if that is more, so much that entries live as long as the budget demands: `level` (budgetLevel()).
inline float spanAhead(float allowed, float level)
{
    return maxNumber(kFill * allowed / kCurve, level);
}

// Change at the beginning of a single key's life, which the camera passes half-way; it is `allowed` when its life
// begins and ends.
inline float halfLife(float allowed, float level)
{
    return maxNumber(kLeadShare * allowed, 0.5f * level);
}

// Finds a place ahead on the camera's way to which the change from here is at most `lead`, if it is `least` frames away
// or more. `rate`: Outlook::rate. Returns false and leaves `center` as it is if there is none.
template <typename Change>
inline bool placeAhead(const EyeMotion& motion, float rate, float lead, float least, const Change& change,
                       float* center)
{
    float frames = minNumber(lead / rate, kMaxLeadFrames);
    bool found = false;
    // note: tries twice, since close to an anchor the change is not linear in the motion
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

// Returns true if a strip must be decoded whatever the budget: without a budget every strip that is due; otherwise a
// strip without an entry, or one that is grossly wrong.
inline bool mustDecode(const ReuseRule& rule, bool kept, float error)
{
    return rule.decode_budget == 0 || !kept || !(error <= kGross);
}

// Bucket of an urgency; buckets are ranges of the float's bits, from 2^-16 up.
inline uint32_t urgencyBucket(float urgency)
{
    const int octaves = int(__builtin_bit_cast(uint32_t, maxNumber(urgency, 0.0f)) >> 15) - ((127 - 16) << 8);
    return kUrgencies - 1 - uint32_t(clampInt(octaves, 0, int(kUrgencies) - 1));
}

// Subdivision of a strip within its bucket of urgency. It differs from frame to frame, so that no strip waits for ever
// behind others.
inline uint32_t splitOf(uint32_t strip, uint32_t frame)
{
    uint32_t mixed = strip * 2654435769u + frame * 2246822519u;
    mixed = (mixed ^ mixed >> 15) * 739982445u;
    return uint32_t(uint64_t(mixed) * kSplits >> 32);
}

// Change at which entries must be decoded again to use up the budget exactly, if each lives until then; 0 if the budget
// is enough for the bound. `rates`: sum of Outlook::rate over the anchors that are due.
inline float budgetLevel(const ReuseRule& rule, uint64_t due, float rates)
{
    return due > rule.decode_budget && rule.decode_budget > 0 ? rates / float(rule.decode_budget) : 0.0f;
}

} // namespace gsc
