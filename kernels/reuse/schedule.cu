// SPDX-License-Identifier: Apache-2.0
// Which listed strips are drawn as they are kept and which are to be decoded again, by policy.h. One look at its entry
// decides most strips, a lane each; the rest take a warp each, an anchor and eye to a lane.
#include "kernels/cuda/halves.cuh"
#include "kernels/cuda/launch.cuh"
#include "kernels/cuda/warp_list.cuh"
#include "kernels/reuse/draw_again.cuh"
#include "kernels/reuse/reuse_cuda.h"

namespace gsc {

namespace {

constexpr uint32_t kThreads = 256;
constexpr uint32_t kBlocksPerProcessor = 3; // all that a multiprocessor holds: 80 registers

// What a warp knows of one strip: lanes 0 to 15 its anchors for the left eye, the others for the right.
struct StripLane {
    uint32_t eye, row, lanes; // lanes: visible to the eye
    Vec3<float> p;
    float direction, distance;
};

// What an eye draws of a strip unless that is decoded.
struct Choice {
    uint32_t own;   // slot of the eye's own entry, or kNoEntry
    uint32_t slot;  // of the entry that it draws: the same, or the other eye's
    StripKeys keys; // of that
    float error;    // 1 = full scale
    bool good;      // the policy allows it
};

struct Tally {
    uint32_t decoded[kMaxEyes] = {}, reused[kMaxEyes] = {}; // per lane
};

__device__ StripLane laneOf(const ScheduleCudaArgs& args, const ListedStrip& listed)
{
    const uint32_t lane = threadIdx.x & 31u;
    StripLane s{lane >> 4, lane & 15u, listed.lanes >> (lane & 16u) & 0xffffu, {}, 0, 0};
    const uint32_t anchor = listed.first + min(s.row, listed.count - 1);
    const float4 place = reinterpret_cast<const float4*>(args.placement)[anchor];
    s.p = {place.x, place.y, place.z};
    if (args.sensitivity != nullptr) {
        const float2 halves = halvesOf(args.sensitivity[anchor]);
        s.direction = fmaxf(halves.x, kLeastSensitivity);
        s.distance = halves.y;
    }
    return s;
}

__device__ float halfMax(float v)
{
#pragma unroll
    for (uint32_t with = 8; with != 0; with /= 2)
        v = fmaxf(v, __shfl_xor_sync(~0u, v, int(with)));
    return v;
}

// The `change` of policy.h for the anchors `lanes`. All lanes of the warp call it together.
struct LargestChange {
    const StripLane& s;
    uint32_t lanes;

    __device__ float operator()(const float* c0, const float* c1) const
    {
        const float change = predictedChange(s.p, c0, c1, s.direction, s.distance);
        return halfMax((lanes >> s.row & 1u) == 0 ? 0.0f : change == change ? change : INFINITY);
    }
};

// May the eye draw the entry, as far as one look at it tells? No never means no under ReusePolicy::Error.
__device__ bool surelyGood(const ReuseNow& now, uint32_t depth, uint32_t eye, const ListedStrip& listed,
                           const KeptEntry& kept)
{
    if (now.policy == ReusePolicy::Depth)
        return youngEnough(now.frame, kept.decoded, depth);
    return (lanesOfAnyEye(listed.lanes) & ~kept.keys.lanes) == 0 &&
           changeAtMost(now.rule, kept.keys, now.rule.eye[eye].center).error <=
               allowedChange(now.rule, eye, listed.strip, kept.keys);
}

// Of the anchors `lanes`; of none: what adds nothing to another.
__device__ StripReach reachOf(const StripLane& s, uint32_t lanes, const float* center)
{
    const bool counts = (lanes >> s.row & 1u) != 0;
    const float x = s.p.x - center[0], y = s.p.y - center[1], z = s.p.z - center[2];
    const float length = sqrtf(x * x + y * y + z * z), sum = s.direction + s.distance;
    return {halfMax(counts ? sum / length : 0.0f), -halfMax(counts ? -length : -INFINITY),
            halfMax(counts ? sum : 0.0f)};
}

// Span and reach of an eye's own entry are of those anchors that were seen so far: what passes beside the camera,
// unseen, changes so fast that it would have its whole strip decoded every other frame. `lanes`: seen by now. All lanes
// of the warp call it together, each half for its own entry.
__device__ void widen(const StripLane& s, uint32_t lanes, StripKeys& keys, KeptEntry* entry)
{
    const uint32_t more = entry != nullptr ? lanes & ~keys.lanes : 0u;
    if (!__any_sync(~0u, more != 0))
        return;
    const float span = LargestChange{s, keys.count == 2 ? more : 0}(keys.center[0], keys.center[1]);
    const StripReach reach = reachOf(s, more, keys.center[1]);
    if (more == 0)
        return;
    keys.span = fmaxf(keys.span, span);
    keys.reach = {fmaxf(keys.reach.rate, reach.rate), fminf(keys.reach.nearest, reach.nearest),
                  fmaxf(keys.reach.weight, reach.weight)};
    keys.lanes |= more;
    if (s.row == 0)
        entry->keys = keys;
}

__device__ Choice ownEntry(const ScheduleCudaArgs& args, const StripLane& s, const ListedStrip& listed, uint32_t depth)
{
    const ReuseNow& now = args.now;
    const uint32_t own = args.tables.slot_of[s.eye][listed.strip];
    KeptEntry kept{};
    if (own != kNoEntry)
        kept = args.tables.entries[own];
    Choice choice{own, own, kept.keys, INFINITY, own != kNoEntry && youngEnough(now.frame, kept.decoded, depth)};
    if (now.policy == ReusePolicy::Depth)
        return choice;
    widen(s, lanesOfAnyEye(listed.lanes), choice.keys, own != kNoEntry ? args.tables.entries + own : nullptr);
    const float error = changeOf(now.rule, choice.keys, now.rule.eye[s.eye].center, LargestChange{s, s.lanes}).error;
    if (own != kNoEntry)
        choice.error = error;
    choice.good = choice.error <= allowedChange(now.rule, s.eye, listed.strip, choice.keys);
    return choice;
}

// The other eye's entry, where it is the better one; it is good only if it is not to be decoded again.
__device__ void considerOther(const ScheduleCudaArgs& args, const StripLane& s, const ListedStrip& listed,
                              Choice& choice)
{
    const ReuseRule& rule = args.now.rule;
    const uint32_t others = __shfl_xor_sync(~0u, choice.own, 16);
    const bool stays = __shfl_xor_sync(~0u, uint32_t(choice.good || s.lanes == 0), 16) != 0;
    StripKeys there{};
    if (others != kNoEntry)
        there = args.tables.entries[others].keys;
    there.span = __shfl_xor_sync(~0u, choice.keys.span, 16); // as the other half has widened it
    const float error = changeOf(rule, there, rule.eye[s.eye].center, LargestChange{s, s.lanes}).error;
    if (choice.good || others == kNoEntry || !(error < choice.error))
        return;
    choice.slot = others;
    choice.error = error;
    choice.keys = there;
    choice.good = stays && error <= allowedChange(rule, s.eye, listed.strip, there);
}

// Where to decode a strip from: from here and from ahead on the camera's way, so that between the two the error stays
// below the bound; if that is too near, from half a life ahead, so that the error starts below the bound, falls to zero
// and rises again. A camera that does not move steadily has the place it is at. As far as the bound allows or, where
// that is more, as long as the budget makes entries live.
__device__ StripKeys planFor(const ScheduleCudaArgs& args, const StripLane& s, const ListedStrip& listed, float rate,
                             bool fresh)
{
    const ReuseNow& now = args.now;
    const ReuseRule& rule = now.rule;
    const EyeMotion& motion = rule.eye[s.eye];
    const uint32_t seen = lanesOfAnyEye(listed.lanes);
    const LargestChange change{s, s.lanes};
    StripKeys plan = keysAt(motion.center, seen, fresh);
    if (rule.eye[0].steady || rule.eye[1].steady) { // the same for the whole warp
        const ReuseState& state = args.tables.scratch->state;
        // what is new is decoded whatever the budget, and no better for being far off
        const uint32_t before = (now.frame - 1) & 1u;
        const bool waits = rule.decode_budget > 0 && !fresh && state.level_frame[before] == now.frame - 1;
        const float level = waits ? state.level[before][s.eye] : 0.0f;
        const float span = spanAhead(rule.tuning, rule.bound, level) * (0.5f + 0.5f * stagger(listed.strip));
        float ahead[3] = {motion.center[0], motion.center[1], motion.center[2]};
        // a budget that takes no strip with two keys would decode nothing on the way
        const bool affordable = rule.decode_budget == 0 || rule.decode_budget >= 2 * kStripAnchors;
        const bool two = placeAhead(motion, rate, span, 1.0f, change, ahead) && motion.steady && affordable;
        const float between = LargestChange{s, seen}(motion.center, ahead);
        const float half = halfLife(allowedChange(rule, s.eye, listed.strip, plan), level);
        float half_way[3] = {motion.center[0], motion.center[1], motion.center[2]};
        const bool one = placeAhead(motion, rate, half, 0.5f, change, half_way) && motion.steady;
        for (int i = 0; i < 3; ++i) {
            if (two)
                plan.center[1][i] = ahead[i];
            else if (one)
                plan.center[0][i] = plan.center[1][i] = half_way[i];
        }
        plan.count = two ? 2 : 1;
        plan.span = two ? between : 0.0f;
    }
    plan.reach = reachOf(s, seen, plan.center[1]);
    return plan;
}

// Does the right eye draw what the left one plans to have decoded?
__device__ bool rightShares(const ScheduleCudaArgs& args, const StripLane& s, uint32_t strip, const StripKeys& plan,
                            bool due)
{
    const ReuseRule& rule = args.now.rule;
    StripKeys left{};
#pragma unroll
    for (int i = 0; i < 6; ++i)
        left.center[i / 3][i % 3] = __shfl_sync(~0u, plan.center[i / 3][i % 3], 0);
    left.span = __shfl_sync(~0u, plan.span, 0);
    left.count = uint8_t(__shfl_sync(~0u, uint32_t(plan.count), 0));
    left.fresh = uint8_t(__shfl_sync(~0u, uint32_t(plan.fresh), 0));
    const float error = changeOf(rule, left, rule.eye[s.eye].center, LargestChange{s, s.lanes}).error;
    const bool shares = due && error <= allowedChange(rule, 1, strip, left);
    return __shfl_sync(~0u, uint32_t(due), 0) != 0 && __shfl_sync(~0u, uint32_t(shares), 16) != 0;
}

// A want of `listed`, the strip `index` of the list, whose eye has no slot yet where it is fresh. Lanes that do not want
// call it too.
__device__ void addWant(const ScheduleCudaArgs& args, bool wants, const Want& want)
{
    const ReuseTables& tables = args.tables;
    const uint32_t at = appendPlace(wants, threadIdx.x & 31u, &tables.scratch->counters.wants);
    if (!wants)
        return;
    tables.wants[at] = want;
    if (want.keys.fresh != 0 && !args.ample) {
        atomicAdd(&tables.scratch->counters.wanted, 1u);
        atomicAdd(&tables.scratch->orders[uint64_t(want.strip.strip) * kOrders / tables.strips], 1u);
    }
}

// What a want takes of the budget, and where in its order.
__device__ void countWant(const ScheduleCudaArgs& args, const Want& want, float rate, Tally& tally)
{
    ReuseCounters& counters = args.tables.scratch->counters;
    const uint32_t decodes = want.strip.count * want.keys.count;
    if (want.bucket == kMust)
        tally.decoded[want.eye] += decodes;
    else
        atomicAdd(&args.tables.scratch->urgencies[want.eye][want.bucket], decodes);
    if (args.now.rule.decode_budget > 0) {
        atomicAdd(&counters.due[want.eye], decodes);
        if (rate < INFINITY) // a camera on an anchor changes everything at once
            atomicAdd(&counters.rates[want.eye], (unsigned long long)(fminf(rate, 1e6f) * kRateUnit) * decodes);
    }
}

// What an eye draws of strip `index` of the list unless it is decoded, and that its entries are in use.
__device__ void noteDrawn(const ScheduleCudaArgs& args, const StripLane& s, uint32_t strip, uint32_t index,
                          const Choice& choice, Tally& tally)
{
    const ReuseTables& tables = args.tables;
    if (s.row != 0)
        return;
    const bool draws = s.lanes != 0 && choice.good;
    tables.drawn[index].slot[s.eye] = tables.decided[strip].slot[s.eye] = draws ? choice.slot : kNoEntry;
    if (draws)
        tally.reused[s.eye] += __popc(s.lanes);
    if (s.lanes != 0 && choice.slot != kNoEntry)
        tables.entries[choice.slot].used = args.now.frame;
    if (s.lanes != 0 && choice.own != kNoEntry)
        tables.entries[choice.own].used = args.now.frame; // it is replaced if that is granted
}

// Decides for a strip that takes more than a look. All lanes of the warp work on it.
__device__ void decide(const ScheduleCudaArgs& args, const ListedStrip& listed, uint32_t index, uint32_t depth,
                       Tally& tally)
{
    const ReuseNow& now = args.now;
    const StripLane s = laneOf(args, listed);
    Choice choice = ownEntry(args, s, listed, depth);
    const bool by_error = now.policy == ReusePolicy::Error, fresh = choice.own == kNoEntry;
    if (by_error && now.eye_count > 1)
        considerOther(args, s, listed, choice);
    const bool leads = s.row == 0 && s.lanes != 0; // one lane per eye writes
    const bool due = s.lanes != 0 && !choice.good;
    noteDrawn(args, s, listed.strip, index, choice, tally);

    Want want{};
    want.strip = listed;
    want.keys = keysAt(now.rule.eye[s.eye].center, lanesOfAnyEye(listed.lanes), fresh);
    want.eye = s.eye;
    want.index = index;
    Outlook outlook{0, choice.error};
    bool shares = false;
    if (by_error) {
        outlook = outlookOf(now.rule, s.eye, choice.keys, LargestChange{s, s.lanes});
        want.keys = planFor(args, s, listed, outlook.rate, fresh);
        shares = rightShares(args, s, listed.strip, want.keys, due);
    }
    if (choice.slot == kNoEntry)
        outlook.urgency = INFINITY;
    for (uint32_t e = 0; e < kMaxEyes; ++e)
        want.fallback[e] = __shfl_sync(~0u, choice.slot, int(16 * e));
    const float right_urgency = __shfl_sync(~0u, outlook.urgency, 16), right_error = __shfl_sync(~0u, choice.error, 16);
    if (s.eye == 0 && shares) {
        outlook.urgency = fmaxf(outlook.urgency, right_urgency);
        choice.error = fmaxf(choice.error, right_error);
    }
    want.eyes = 1u << s.eye | (shares ? 2u : 0u);
    want.bucket = mustDecode(now.rule, choice.slot != kNoEntry, choice.error) ? kMust : urgencyBucket(outlook.urgency);
    const bool wants = leads && due && !(s.eye == 1 && shares);
    addWant(args, wants, want);
    if (wants)
        countWant(args, want, outlook.rate, tally);
}

// Decides for a strip that both eyes are to draw from one entry and whose entry is none or too old: the GS-Cache paper's
// depth with its one decode for both eyes. All lanes of the warp call it together.
__device__ void decideMerged(const ScheduleCudaArgs& args, const ListedStrip& listed, uint32_t index, Tally& tally)
{
    const ReuseTables& tables = args.tables;
    const bool leads = (threadIdx.x & 31u) == 0;
    const uint32_t own = tables.slot_of[0][listed.strip];
    Want want{};
    want.strip = listed;
    want.keys = keysAt(args.now.look_from, lanesOfAnyEye(listed.lanes), own == kNoEntry);
    want.index = index;
    want.fallback[0] = want.fallback[1] = own;
    want.eyes = ((listed.lanes & 0xffffu) != 0 ? 1u : 0u) | (listed.lanes >> 16 != 0 ? 2u : 0u);
    want.bucket = kMust;
    addWant(args, leads, want);
    if (!leads)
        return;
    tables.drawn[index] = tables.decided[listed.strip] = {{kNoEntry, kNoEntry}};
    tally.decoded[(want.eyes & 1u) != 0 ? 0 : 1] += listed.count;
    if (own != kNoEntry)
        tables.entries[own].used = args.now.frame; // it is replaced
}

__global__ void __launch_bounds__(kThreads, kBlocksPerProcessor)
    scheduleKernel(const __grid_constant__ ScheduleCudaArgs args)
{
    const ReuseNow& now = args.now;
    const ReuseTables& tables = args.tables;
    const uint32_t lane = threadIdx.x & 31u;
    const uint32_t warp = (blockIdx.x * kThreads + threadIdx.x) >> 5, warps = gridDim.x * kThreads / 32;
    const uint32_t strips = tables.scratch->counters.strips;
    if (now.again != 0) {
        for (uint32_t base = warp * 32; base < strips; base += warps * 32)
            drawAgain(tables, base + lane, lane);
        return;
    }
    const uint64_t visible = uint64_t(args.frame->anchors_visible[0]) + args.frame->anchors_visible[1];
    const uint32_t depth =
        now.policy == ReusePolicy::Depth
            ? reuseDepth(now.guidance, now.max_depth, updateRate(tables.scratch->counters.fresh, visible))
            : 0u;
    Tally tally;
    for (uint32_t base = warp * 32; base < strips; base += warps * 32) {
        const uint32_t i = base + lane;
        ListedStrip listed{};
        uint32_t slots[kMaxEyes] = {kNoEntry, kNoEntry};
        KeptEntry kept[kMaxEyes];
        bool open = false;
        if (i < strips) {
            listed = tables.listed[i];
#pragma unroll
            for (uint32_t e = 0; e < kMaxEyes; ++e)
                if ((listed.lanes >> (16 * e) & 0xffffu) != 0) {
                    slots[e] = tables.slot_of[now.merged != 0 ? 0 : e][listed.strip];
                    if (slots[e] != kNoEntry)
                        kept[e] = tables.entries[slots[e]];
                    open |= slots[e] == kNoEntry || !surelyGood(now, depth, e, listed, kept[e]);
                }
        }
        if (i < strips && !open) {
            tables.drawn[i] = tables.decided[listed.strip] = {{slots[0], slots[1]}};
#pragma unroll
            for (uint32_t e = 0; e < kMaxEyes; ++e)
                if (slots[e] != kNoEntry) {
                    tables.entries[slots[e]].used = now.frame;
                    tally.reused[e] += __popc(listed.lanes >> (16 * e) & 0xffffu);
                }
        }
        for (uint32_t rest = __ballot_sync(~0u, open); rest != 0; rest &= rest - 1) {
            const int from = __ffs(int(rest)) - 1;
            const ListedStrip one{__shfl_sync(~0u, listed.strip, from), __shfl_sync(~0u, listed.first, from),
                                  __shfl_sync(~0u, listed.lanes, from), __shfl_sync(~0u, listed.count, from)};
            if (now.merged != 0)
                decideMerged(args, one, base + uint32_t(from), tally);
            else
                decide(args, one, base + uint32_t(from), depth, tally);
        }
    }
    for (uint32_t e = 0; e < kMaxEyes; ++e) {
        addOfWarp(&tables.scratch->counters.decoded[e], tally.decoded[e], lane);
        addOfWarp(&tables.scratch->counters.reused[e], tally.reused[e], lane);
    }
}

} // namespace

void scheduleCuda(const ScheduleCudaArgs& args, uint32_t processors, CUstream_st* stream)
{
    launchCuda(scheduleKernel, processors * kBlocksPerProcessor, kThreads, 0, stream, args);
}

} // namespace gsc
