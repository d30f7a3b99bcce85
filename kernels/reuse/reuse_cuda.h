// SPDX-License-Identifier: Apache-2.0
// Decoded Gaussians kept across frames on a device (design section 5, cache "decoded"): what is kept, what a frame
// decides, and the launches that decide it. Plain data, no CUDA header. With merged stereo the first eye owns all entries.
//
// A frame with reuse lists its visible strips (select), schedules them, grants what the budgets allow, decodes that
// (decode_cuda.h) and draws the rest from its entries. What is decided depends on nothing but the frames so far: not on
// the order of atomics, and not on how often a frame was drawn again because a buffer was too small, since that draws
// what was decided the first time.
#pragma once

#include "kernels/frame/device_model.h"
#include "kernels/frame/frame_now.h"
#include "kernels/reuse/policy.h"
#include "kernels/reuse/schedule.h"

struct CUstream_st;

namespace gsc {

constexpr uint32_t kNoEntry = ~0u;   // slot
constexpr uint32_t kKeptWords = 3;   // of 8 bytes, per Gaussian of an entry and key (kept_entry.cuh)
constexpr uint32_t kAges = 1u << 16; // buckets, oldest first: frames not drawn, then strips in no order
constexpr float kRateUnit = 1048576.0f;
constexpr uint32_t kOrders = 1024; // buckets of strips in file order

// A strip with a visible anchor, as select lists it.
struct alignas(16) ListedStrip {
    uint32_t strip; // kStripsPerGroup x its group + its place there
    uint32_t first; // anchor
    uint32_t lanes; // visible anchors: of the left eye from bit 0, of the right from bit 16
    uint32_t count; // anchors
};

// The anchors of `lanes`, ListedStrip::lanes, that some eye sees.
GSC_HD uint32_t lanesOfAnyEye(uint32_t lanes)
{
    return (lanes | lanes >> 16) & 0xffffu;
}

struct alignas(8) SeenStrip {
    uint32_t lanes, frame; // ListedStrip::lanes in that frame
};

struct alignas(8) KeptWord {
    uint32_t low, high;
};

// A strip as one or two camera centres saw it.
struct alignas(16) KeptEntry {
    StripKeys keys;
    uint32_t decoded;     // frame
    uint32_t used;        // frame that drew it last
    uint32_t owner;       // strip x 2 + eye it was decoded for, or kNoEntry: free
    uint16_t alive;       // Gaussians
    uint16_t positive[2]; // per key: anchors with an opacity above zero
};
static_assert(sizeof(KeptEntry) == 64);

// Something the policy wants decoded.
struct alignas(16) Want {
    ListedStrip strip;
    StripKeys keys;       // where from
    uint32_t eye;         // whose entry
    uint32_t index;       // of the strip in the list
    uint32_t fallback[2]; // slots that the eyes draw if it is not granted
    uint32_t eyes;        // that draw it: its own, and the other where the bound allows it
    uint32_t bucket;      // of urgency, or kMust
    uint32_t slot;        // granted: that of the entry, or kNoEntry
};
static_assert(sizeof(Want) == 96);

// What the eyes draw of a listed strip.
struct alignas(8) DrawnSlots {
    uint32_t slot[kMaxEyes]; // kNoEntry: nothing that is kept
};

// What changes from frame to frame beside FrameNow.
struct ReuseNow : FrameNow {
    uint32_t frame;  // counts from 1; a frame drawn again has the same
    uint32_t again;  // other than 0: it is
    uint32_t merged; // other than 0: one entry for both eyes, decoded from look_from (StereoMode::Merged)
    uint32_t eye_count;
    ReuseRule rule;
    ReusePolicy policy;
    DepthGuidance guidance;
    uint32_t max_depth;
};

// Of one frame.
struct ReuseCounters {
    uint32_t strips; // listed
    uint32_t wants, decodes;
    uint32_t fresh;  // visible anchors that the frame before did not see, of all eyes; only by ReusePolicy::Depth
    uint32_t wanted; // slots, unless they are ample
    uint32_t decoded[kMaxEyes], reused[kMaxEyes], overdue[kMaxEyes]; // anchors; decoded: times keys
    uint32_t due[kMaxEyes];                                          // the same, if all was that the policy wants
    unsigned long long rates[kMaxEyes];   // sum over those of what a step of the camera changes, x kRateUnit
    uint32_t granted_before[kMaxEyes];    // buckets of urgency below this are granted
    uint32_t split_left[kMaxEyes];        // what they leave of the budget, less than that bucket takes
    uint32_t split_before[kMaxEyes];      // strips of that bucket below this in their order are granted
    uint32_t evicted_before, kept_before; // buckets of age, of order: those that give their slot, that get one
};

// Kept from frame to frame.
struct ReuseState {
    uint32_t free_slots, evictions; // since resetReuseCuda()
    // error at which the budget of a frame refreshed entries, 0 = it met the bound; per parity of its number
    float level[2][kMaxEyes];
    uint32_t level_frame[2];
};

// In one piece: the host reads the first two, and what follows the state is cleared before a frame, as far as it is used.
struct ReuseScratch {
    ReuseState state;
    ReuseCounters counters;
    uint32_t orders[kOrders];                 // wanted slots
    uint32_t urgencies[kMaxEyes][kUrgencies]; // anchors, times keys
    uint32_t splits[kMaxEyes][kSplits];       // the same
    uint32_t ages[kAges];                     // entries
};

// Device pointers. `strips` of the model have an entry per eye at most.
struct ReuseTables {
    uint32_t strips, slots;
    ListedStrip* listed;         // strips
    SeenStrip* seen[2];          // strips each, per parity of the frame
    uint32_t* slot_of[kMaxEyes]; // strips
    KeptEntry* entries;          // slots
    KeptWord* words;             // slots x 2 keys x kKeptWords x room
    uint32_t room;               // Gaussians of an entry
    uint32_t* free_list;         // slots
    Want* wants;                 // kMaxEyes x strips
    DrawnSlots* drawn;           // strips, as listed
    DrawnSlots* decided;         // strips in file order: the same, of those listed, for a frame that is drawn again
    uint32_t* decodes;           // kMaxEyes x strips: granted wants
    ReuseScratch* scratch;
};

struct ScheduleCudaArgs {
    using Now = ReuseNow;

    ReuseNow now;
    const float* placement;      // DeviceModel
    const uint32_t* sensitivity; // AnchorSensitivity per anchor, or null: ReusePolicy::Depth
    const FrameCounters* frame;  // after select
    ReuseTables tables;
    bool ample; // there is a slot for every strip and eye
};

inline void setNow(ScheduleCudaArgs& args, const ReuseNow& now)
{
    args.now = now;
}

// Forgets everything. Asynchronous, as all.
void resetReuseCuda(const ReuseTables& tables, CUstream_st* stream);
// Lists what is drawn from entries and what is to be decoded.
void scheduleCuda(const ScheduleCudaArgs& args, uint32_t processors, CUstream_st* stream);
// Unless slots are ample: how long ago the entries were drawn.
void countAgesCuda(const ScheduleCudaArgs& args, uint32_t processors, CUstream_st* stream);
// With a decode budget, or unless slots are ample: how far they reach.
void reuseLevelsCuda(const ScheduleCudaArgs& args, CUstream_st* stream);
// With a decode budget, one after the other: how far what whole buckets of urgency leave of it reaches in the next one.
void countSplitsCuda(const ScheduleCudaArgs& args, uint32_t processors, CUstream_st* stream);
void splitLevelsCuda(const ScheduleCudaArgs& args, CUstream_st* stream);
// Unless slots are ample: gives up the entries drawn least recently, as many as are wanted and some more.
void evictCuda(const ScheduleCudaArgs& args, uint32_t processors, CUstream_st* stream);
// Lists what is decoded, with its slots; the rest of what is to be decoded is drawn as it is.
void grantCuda(const ScheduleCudaArgs& args, uint32_t processors, CUstream_st* stream);

} // namespace gsc
