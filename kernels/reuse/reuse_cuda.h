// SPDX-License-Identifier: Apache-2.0
// Keeps decoded Gaussians across frames on a device, by ReusePolicy::Depth (design section 5, cache "decoded"): what is
// kept, what a frame decides, and the launches that decide it. Plain data, no CUDA header. With merged stereo the first
// eye owns all entries.
//
// A frame with reuse lists its visible strips (select), schedules them, claims slots for what it decodes, decodes that
// (reuse_stages_cuda.h) and draws the rest from its entries. A strip has one slot, which it shares with others where
// memory is short: a strip in view keeps it, and of those that want it the first in the file gets it. Decisions depend
// on nothing but the frames so far: not on the order of atomics, and not on how often a frame was drawn again because a
// buffer was too small, since entries decoded by the attempts before are of this frame and are drawn.
#pragma once

#include "kernels/frame/device_model.h"
#include "kernels/frame/frame_now.h"
#include "kernels/reuse/depth.h"

struct CUstream_st;

namespace gsc {

constexpr uint32_t kNoEntry = ~0u;
constexpr uint32_t kKeptWords = 3; // words of 8 bytes for each Gaussian of an entry (kept_entry.cuh)

// A strip with a visible anchor, as select lists it.
struct alignas(16) ListedStrip {
    uint32_t strip; // kStripsPerGroup x number of its group + number in the group
    uint32_t first; // number of the strip's first anchor
    uint32_t lanes; // visible anchors of the strip, a bit each: for the left eye from bit 0, for the right from bit 16
    uint32_t count; // number of anchors in the strip
};

// Anchors in ListedStrip::lanes that an eye sees, a bit each.
GSC_HD uint32_t lanesOfEye(uint32_t lanes, uint32_t eye)
{
    return lanes >> (16 * eye) & 0xffffu;
}

struct alignas(8) SeenStrip {
    uint32_t lanes, frame; // frame: number of a frame; lanes: ListedStrip::lanes of the strip in it
};

struct alignas(8) KeptWord {
    uint32_t low, high;
};

// State of a cache slot: the strip that it holds, decoded for an eye.
struct alignas(16) KeptEntry {
    uint32_t decoded;  // number of the frame that decoded the entry
    uint32_t used;     // number of the frame that drew the entry last
    uint32_t owner;    // ReuseTables::idOf() of the strip, or kNoEntry if the slot is free
    uint16_t alive;    // number of Gaussians in the entry
    uint16_t positive; // anchors with an opacity above zero, a bit each
};

// A strip that is to be decoded.
struct alignas(16) Want {
    ListedStrip strip;
    uint32_t index; // index of the strip in the list of visible strips
    uint32_t eye;   // eye to which the entry will belong
    uint32_t eyes;  // eyes that draw the strip, a bit each
};

// Values that change from frame to frame: FrameNow, and those of reuse.
struct ReuseNow : FrameNow {
    uint32_t frame;  // number of the frame, from 1; a frame that is drawn again keeps its number
    uint32_t merged; // not 0 if both eyes share one entry, decoded from look_from (StereoMode::Merged)
    DepthGuidance guidance;
    uint32_t max_depth;
};

// Counters of a frame with reuse, cleared before it.
struct ReuseCounters {
    uint32_t strips; // number of strips in the list
    uint32_t wants;
    uint32_t fresh; // visible anchors, of all eyes, that were not visible in the frame before
    uint32_t evictions;
    // for each eye: numbers of anchors that were decoded, and that were drawn from entries
    uint32_t decoded[kMaxEyes], reused[kMaxEyes];
};

// Tables of reuse, device pointers.
struct ReuseTables {
    uint32_t strips; // number of strips of the model
    uint32_t slots;  // number of cache slots, at most one for each strip and eye
    uint32_t room;   // largest number of Gaussians in an entry
    ReuseCounters* counters;
    // per slot the bitwise complement of the smallest idOf() that wants it; behind the counters, and cleared with them
    uint32_t* claims;
    ListedStrip* listed; // room for all strips of the model
    Want* wants;         // room for kMaxEyes x strips that are to be decoded
    SeenStrip* seen[2];  // for each strip, one array for even and one for odd frames
    KeptEntry* entries;  // state of each cache slot
    KeptWord* words;     // slots x kKeptWords x room words

    // Number of a strip as decoded for an eye.
    GSC_HD uint32_t idOf(uint32_t strip, uint32_t eye) const { return eye * strips + strip; }
    GSC_HD uint32_t slotOf(uint32_t id) const { return id % slots; }
    // Cache slot that holds the entry of a strip and eye, or kNoEntry. After decoding it is valid for strips in view.
    GSC_HD uint32_t keptSlot(uint32_t strip, uint32_t eye) const
    {
        const uint32_t id = idOf(strip, eye), slot = slotOf(id);
        return entries[slot].owner == id ? slot : kNoEntry;
    }
};

struct ScheduleCudaArgs {
    using Now = ReuseNow;

    ReuseNow now;
    const FrameCounters* frame; // counters that select has filled
    ReuseTables tables;
};

inline void setNow(ScheduleCudaArgs& args, const ReuseNow& now)
{
    args.now = now;
}

// Decides which strips are drawn from entries, and lists those to be decoded. Asynchronous, as is claimCuda().
void scheduleCuda(const ScheduleCudaArgs& args, uint32_t processors, CUstream_st* stream);
// Claims cache slots for strips that have none. Follows scheduleCuda().
void claimCuda(const ScheduleCudaArgs& args, uint32_t processors, CUstream_st* stream);

} // namespace gsc
