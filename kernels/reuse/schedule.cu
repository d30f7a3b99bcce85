// SPDX-License-Identifier: Apache-2.0
#include "kernels/cuda/halves.cuh"
#include "kernels/cuda/launch.cuh"
#include "kernels/reuse/draw_again.cuh"
#include "kernels/reuse/reuse_cuda.h"
#include "kernels/reuse/warp_list.cuh"

namespace gsc {

namespace {

constexpr uint32_t kThreads = 256;
constexpr uint32_t kBlocksPerProcessor = 4;
// Entries that replace others are spread by what the first ones of their strips were spread by, and need little more.
// Those of two keys must not come due half-way, where they are kLeadShare of the bound off.
constexpr float kLaterSpread = 0.15f, kTwoKeysSpread = 0.3f;
// What a first frame decoded has one key and changes with every step of the camera as nothing later does.
constexpr float kFreshShare = 0.5f;

// What a warp knows of one strip: lanes 0 to 15 its anchors for the left eye, the others for the right.
struct StripLane {
    uint32_t eye, row, lanes; // lanes: visible to the eye
    Vec3<float> p;
    float direction, distance;

    [[nodiscard]] __device__ bool sees() const { return (lanes >> row & 1u) != 0; }
};

__device__ float halfMax(float v)
{
#pragma unroll
    for (uint32_t with = 8; with != 0; with /= 2)
        v = fmaxf(v, __shfl_xor_sync(~0u, v, int(with)));
    return v;
}

// Largest change that those of an eye's anchors that count see of a camera that goes from c0 to c1.
__device__ float largestChange(const StripLane& s, bool counts, const float* c0, const float* c1)
{
    const float change = predictedChange<float>(s.p, c0, c1, s.direction, s.distance);
    return halfMax(!counts ? 0.0f : change == change ? change : INFINITY);
}

__device__ float tolerance(const ReuseNow& now, uint32_t eye, uint32_t strip, uint32_t keys, bool fresh)
{
    if (now.steady[eye] == 0)
        return now.erratic[eye] != 0 ? kErraticShare * now.bound : now.bound;
    // what a first frame decoded would be due all at once, and the picture would jump
    const float spread = stagger(strip);
    const float share = keys == 2 ? kTwoKeysSpread : kLaterSpread;
    return now.bound * (keys == 1 && fresh ? kFreshShare * spread : 1 - share + share * spread);
}

__device__ float tolerance(const ReuseNow& now, uint32_t eye, uint32_t strip, const KeptEntry& kept)
{
    return tolerance(now, eye, strip, kept.keys, kept.fresh != 0);
}

__device__ KeyPlace placeOf(const KeptEntry& kept, const float* camera)
{
    return placeBetween(kept.center, kept.keys, kept.span, camera);
}

// May the eye draw the entry, as far as one look at it tells? No never means no under ReusePolicy::Error.
__device__ bool surelyGood(const ReuseNow& now, uint32_t depth, uint32_t eye, const ListedStrip& listed,
                           const KeptEntry& kept)
{
    if (now.policy == ReusePolicy::Depth)
        return now.frame - kept.decoded <= depth;
    if ((lanesOfAnyEye(listed.lanes) & ~kept.lanes) != 0)
        return false;
    const KeyPlace place = placeOf(kept, now.center[eye]);
    return changeBound(kept.reach, kept.center[1], place.point, now.center[eye]) + place.curve <=
           tolerance(now, eye, listed.strip, kept);
}

struct Tally {
    uint32_t decoded[kMaxEyes] = {}, reused[kMaxEyes] = {}; // per lane
};

// A place ahead on the camera's way where the change from here is `lead`, or less, if that is as many frames as `least`
// ahead. `rate`: what a step of the camera changes.
__device__ bool lookAhead(const StripLane& s, const ReuseNow& now, float rate, float lead, float least, float* center)
{
    float frames = fminf(lead / rate, kMaxLeadFrames);
    bool found = false;
    // note: the change is not linear in the motion close by
    for (int attempt = 0; attempt < 2; ++attempt) {
        float ahead[3];
        for (int i = 0; i < 3; ++i)
            ahead[i] = now.center[s.eye][i] + frames * now.step[s.eye][i];
        const float error = largestChange(s, s.sees(), ahead, now.center[s.eye]);
        if (!found && frames >= least && error <= lead) {
            for (int i = 0; i < 3; ++i)
                center[i] = ahead[i];
            found = true;
        }
        frames *= 0.9f * lead / error;
    }
    return found;
}

// Where to decode a strip from.
struct Plan {
    float center[2][3];
    float span;
    uint32_t keys;
};

// From here and from ahead on the camera's way, so that between the two the error stays below the bound; if that is too
// near, from half a life ahead, so that the error starts below the bound, falls to zero and rises again. A camera that
// does not move steadily has the place it is at. As far as the bound allows or, where that is more, as long as the
// budget makes entries live: `level`.
__device__ Plan planFor(const StripLane& s, const ReuseNow& now, uint32_t strip, uint32_t lanes, float rate,
                        float level, bool fresh)
{
    const float* const camera = now.center[s.eye];
    Plan plan{{{camera[0], camera[1], camera[2]}, {camera[0], camera[1], camera[2]}}, 0, 1};
    const bool steady = now.steady[s.eye] != 0 && now.history[s.eye] >= 2;
    float ahead[3] = {camera[0], camera[1], camera[2]};
    const float life = fmaxf(kLeadShare * now.bound / kCurve, level) * (0.5f + 0.5f * stagger(strip));
    // a budget that takes no strip with two keys would decode nothing on the way
    const bool affordable = now.decode_budget == 0 || now.decode_budget >= 2 * kStripAnchors;
    const bool two = lookAhead(s, now, rate, life, 1.0f, ahead) && steady && affordable;
    const float span = largestChange(s, (lanes >> s.row & 1u) != 0, camera, ahead);
    const float most = tolerance(now, s.eye, strip, 1, fresh);
    float half_way[3] = {camera[0], camera[1], camera[2]};
    const bool one = lookAhead(s, now, rate, fmaxf(kLeadShare * most, 0.5f * level), 0.5f, half_way) && steady;
    for (int i = 0; i < 3; ++i) {
        if (two)
            plan.center[1][i] = ahead[i];
        else if (one)
            plan.center[0][i] = plan.center[1][i] = half_way[i];
    }
    plan.keys = two ? 2 : 1;
    plan.span = two ? span : 0.0f;
    return plan;
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
__device__ void widen(const StripLane& s, uint32_t lanes, KeptEntry& kept, KeptEntry* entry)
{
    const uint32_t more = entry != nullptr ? lanes & ~kept.lanes : 0u;
    if (!__any_sync(~0u, more != 0))
        return;
    const float span = largestChange(s, kept.keys == 2 && (more >> s.row & 1u) != 0, kept.center[0], kept.center[1]);
    const StripReach reach = reachOf(s, more, kept.center[1]);
    if (more == 0)
        return;
    kept.span = fmaxf(kept.span, span);
    kept.reach = {fmaxf(kept.reach.rate, reach.rate), fminf(kept.reach.nearest, reach.nearest),
                  fmaxf(kept.reach.weight, reach.weight)};
    kept.lanes |= more;
    if (s.row == 0) {
        entry->span = kept.span;
        entry->reach = kept.reach;
        entry->lanes = kept.lanes;
    }
}

// Decides for a strip that takes more than a look. All lanes of the warp work on it.
__device__ void decide(const ScheduleCudaArgs& args, const ListedStrip& listed, uint32_t index, uint32_t depth,
                       Tally& tally)
{
    const ReuseNow& now = args.now;
    const ReuseTables& tables = args.tables;
    const uint32_t lane = threadIdx.x & 31u;
    const bool by_error = now.policy == ReusePolicy::Error;
    StripLane s{lane >> 4, lane & 15u, listed.lanes >> (lane & 16u) & 0xffffu, {}, 0, 0};
    const uint32_t anchor = listed.first + min(s.row, listed.count - 1);
    const float4 place = reinterpret_cast<const float4*>(args.placement)[anchor];
    s.p = {place.x, place.y, place.z};
    if (by_error) {
        const float2 halves = halvesOf(args.sensitivity[anchor]);
        s.direction = fmaxf(halves.x, kLeastSensitivity);
        s.distance = halves.y;
    }
    const float* const camera = now.center[s.eye];

    // by its own entry
    const uint32_t own = tables.slot_of[s.eye][listed.strip];
    KeptEntry kept{};
    if (own != kNoEntry)
        kept = tables.entries[own];
    const uint32_t seen = lanesOfAnyEye(listed.lanes);
    if (by_error)
        widen(s, seen, kept, own != kNoEntry ? tables.entries + own : nullptr);
    KeyPlace at = placeOf(kept, camera);
    float error = largestChange(s, s.sees(), at.point, camera) + at.curve;
    if (own == kNoEntry)
        error = INFINITY;
    bool good = own != kNoEntry &&
                (by_error ? error <= tolerance(now, s.eye, listed.strip, kept) : now.frame - kept.decoded <= depth);
    uint32_t slot = own; // what the eye draws if nothing is decoded

    // by the other eye's, unless that is to be decoded again
    const uint32_t others = __shfl_xor_sync(~0u, own, 16);
    const bool stays = __shfl_xor_sync(~0u, uint32_t(good || s.lanes == 0), 16) != 0;
    if (by_error && now.eye_count > 1) {
        KeptEntry there{};
        if (others != kNoEntry)
            there = tables.entries[others];
        there.span = __shfl_xor_sync(~0u, kept.span, 16); // as the other half has widened it
        at = placeOf(there, camera);
        float error_there = largestChange(s, s.sees(), at.point, camera) + at.curve;
        if (others == kNoEntry)
            error_there = INFINITY;
        if (!good && error_there < error) {
            slot = others;
            error = error_there;
            kept = there;
            good = stays && error <= tolerance(now, s.eye, listed.strip, there);
        }
    }
    const bool due = s.lanes != 0 && !good;

    // where from, if it is decoded
    const bool fresh = own == kNoEntry;
    Plan plan{{{camera[0], camera[1], camera[2]}, {camera[0], camera[1], camera[2]}}, 0, 1};
    float rate = 0, urgency = error;
    StripReach reach{};
    bool shared = false;
    if (by_error) {
        if (now.history[0] >= 2 || now.history[1] >= 2) { // the same for the whole warp
            float next[3];
            for (int i = 0; i < 3; ++i)
                next[i] = camera[i] + now.step[s.eye][i];
            rate = largestChange(s, s.sees(), next, camera);
            at = placeOf(kept, next); // an entry whose key lies ahead gets better by itself
            urgency = largestChange(s, s.sees(), at.point, next) + at.curve;
            const ReuseState& state = tables.scratch->state;
            // what is new is decoded whatever the budget, and no better for being far off
            const uint32_t before = (now.frame - 1) & 1u;
            const bool waits = now.decode_budget > 0 && !fresh && state.level_frame[before] == now.frame - 1;
            plan = planFor(s, now, listed.strip, seen, rate, waits ? state.level[before][s.eye] : 0.0f, fresh);
        }
        reach = reachOf(s, seen, plan.center[1]);
        Plan left;
#pragma unroll
        for (int i = 0; i < 6; ++i)
            left.center[i / 3][i % 3] = __shfl_sync(~0u, plan.center[i / 3][i % 3], 0);
        left.span = __shfl_sync(~0u, plan.span, 0);
        left.keys = __shfl_sync(~0u, plan.keys, 0);
        const bool left_fresh = __shfl_sync(~0u, uint32_t(fresh), 0) != 0;
        at = placeBetween(left.center, left.keys, left.span, camera);
        const float error_shared = largestChange(s, s.sees(), at.point, camera) + at.curve;
        shared = s.eye == 1 && due && error_shared <= tolerance(now, 1, listed.strip, left.keys, left_fresh);
    }
    if (slot == kNoEntry)
        urgency = INFINITY;
    const bool left_due = __shfl_sync(~0u, uint32_t(due), 0) != 0;
    const bool joins =
        __shfl_sync(~0u, uint32_t(shared), 16) != 0 && left_due; // the right eye draws what the left has decoded
    const uint32_t slots[2] = {__shfl_sync(~0u, slot, 0), __shfl_sync(~0u, slot, 16)};
    const float right_urgency = __shfl_sync(~0u, urgency, 16), right_error = __shfl_sync(~0u, error, 16);
    if (lane == 0 && joins) {
        urgency = fmaxf(urgency, right_urgency);
        error = fmaxf(error, right_error);
    }
    // one lane per eye writes
    const bool leads = s.row == 0 && s.lanes != 0;
    const bool wants = leads && due && !(s.eye == 1 && joins);
    const uint32_t entry = appendPlace(wants, lane, &tables.scratch->counters.wants);
    if (wants) {
        Want w{};
        w.strip = listed;
#pragma unroll
        for (int i = 0; i < 6; ++i)
            w.center[i / 3][i % 3] = plan.center[i / 3][i % 3];
        w.span = plan.span;
        w.keys = plan.keys;
        w.eye = s.eye;
        w.reach = reach;
        w.index = index;
        w.fallback[0] = slots[0];
        w.fallback[1] = slots[1];
        w.eyes = 1u << s.eye | (joins ? 2u : 0u);
        w.fresh = fresh ? 1u : 0u;
        const bool must = now.decode_budget == 0 || !by_error || slot == kNoEntry || !(error <= kGross);
        // buckets of the float's own bits, from 2^-16 up
        const int octaves = int(__float_as_uint(fmaxf(urgency, 0.0f)) >> 15) - ((127 - 16) << 8);
        w.bucket = must ? kMust : kUrgencies - 1 - uint32_t(min(max(octaves, 0), int(kUrgencies) - 1));
        tables.wants[entry] = w;
        ReuseCounters& counters = tables.scratch->counters;
        const uint32_t decodes = listed.count * plan.keys;
        if (must)
            tally.decoded[s.eye] += decodes;
        else
            atomicAdd(&tables.scratch->urgencies[s.eye][w.bucket], decodes);
        if (now.decode_budget > 0) {
            atomicAdd(&counters.due[s.eye], decodes);
            if (rate < INFINITY) // a camera on an anchor changes everything at once
                atomicAdd(&counters.rates[s.eye], (unsigned long long)(fminf(rate, 1e6f) * kRateUnit) * decodes);
        }
        if (fresh && !args.ample) {
            atomicAdd(&counters.wanted, 1u);
            atomicAdd(&tables.scratch->orders[uint64_t(listed.strip) * kOrders / tables.strips], 1u);
        }
    }
    if (s.row == 0)
        tables.drawn[index].slot[s.eye] = tables.decided[listed.strip].slot[s.eye] = leads && !due ? slot : kNoEntry;
    if (leads) {
        if (!due)
            tally.reused[s.eye] += __popc(s.lanes);
        if (slot != kNoEntry)
            tables.entries[slot].used = now.frame;
        if (own != kNoEntry)
            tables.entries[own].used = now.frame; // it is replaced if that is granted
    }
}

// Decides for a strip that both eyes are to draw from one entry and whose entry is none or too old: the GS-Cache paper's
// depth with its one decode for both eyes. All lanes of the warp call it together.
__device__ void decideMerged(const ScheduleCudaArgs& args, const ListedStrip& listed, uint32_t index, Tally& tally)
{
    const ReuseTables& tables = args.tables;
    const uint32_t lane = threadIdx.x & 31u;
    const uint32_t entry = appendPlace(lane == 0, lane, &tables.scratch->counters.wants);
    if (lane != 0)
        return;
    const uint32_t own = tables.slot_of[0][listed.strip];
    Want w{};
    w.strip = listed;
    for (int i = 0; i < 3; ++i)
        w.center[0][i] = w.center[1][i] = args.now.look_from[i];
    w.keys = 1;
    w.index = index;
    w.fallback[0] = w.fallback[1] = own;
    w.eyes = ((listed.lanes & 0xffffu) != 0 ? 1u : 0u) | (listed.lanes >> 16 != 0 ? 2u : 0u);
    w.fresh = own == kNoEntry ? 1u : 0u;
    w.bucket = kMust;
    tables.wants[entry] = w;
    tables.drawn[index] = tables.decided[listed.strip] = {{kNoEntry, kNoEntry}};
    tally.decoded[(w.eyes & 1u) != 0 ? 0 : 1] += listed.count;
    if (own != kNoEntry) {
        tables.entries[own].used = args.now.frame; // it is replaced
    } else if (!args.ample) {
        atomicAdd(&tables.scratch->counters.wanted, 1u);
        atomicAdd(&tables.scratch->orders[uint64_t(listed.strip) * kOrders / tables.strips], 1u);
    }
}

__global__ void __launch_bounds__(kThreads) scheduleKernel(const __grid_constant__ ScheduleCudaArgs args)
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
        const uint32_t decoded = __reduce_add_sync(~0u, tally.decoded[e]);
        const uint32_t reused = __reduce_add_sync(~0u, tally.reused[e]);
        if (lane == 0 && decoded != 0)
            atomicAdd(&tables.scratch->counters.decoded[e], decoded);
        if (lane == 0 && reused != 0)
            atomicAdd(&tables.scratch->counters.reused[e], reused);
    }
}

} // namespace

void scheduleCuda(const ScheduleCudaArgs& args, uint32_t processors, CUstream_st* stream)
{
    launchCuda(scheduleKernel, processors * kBlocksPerProcessor, kThreads, 0, stream, args);
}

} // namespace gsc
