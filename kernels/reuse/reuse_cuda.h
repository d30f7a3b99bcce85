// SPDX-License-Identifier: Apache-2.0
// Decoded Gaussians kept across frames on a device, by ReusePolicy::Depth (design section 5, cache "decoded"): what is
// kept, what a frame decides, and the launches that decide it. Plain data, no CUDA header. With merged stereo the first eye
// owns all entries.
//
// A frame with reuse lists its visible strips (select), schedules them, claims slots for what it decodes, decodes that
// (reuse_stages_cuda.h) and draws the rest from its entries. A strip has one slot, which it shares with others where memory
// is short: a strip in view keeps it, and of those that want it the first in the file gets it. Decisions depend on
// nothing but the frames so far: not on the order of atomics, and not on how often a frame was drawn again because a
// buffer was too small, since entries decoded by the attempts before are of this frame and are drawn.
#pragma once

#include "kernels/frame/device_model.h"
#include "kernels/frame/frame_now.h"
#include "kernels/reuse/depth.h"

struct CUstream_st;

namespace gsc {

constexpr uint32_t kNoEntry = ~0u;
constexpr uint32_t kKeptWords = 3; // words of 8 bytes per Gaussian of an entry (kept_entry.cuh)

// A strip with a visible anchor, as select lists it.
struct alignas(16) ListedStrip {
    uint32_t strip; // kStripsPerGroup x its group + its place there
    uint32_t first; // anchor
    uint32_t lanes; // visible anchors: of the left eye from bit 0, of the right from bit 16
    uint32_t count; // anchors
};

// The anchors of ListedStrip::lanes that an eye sees.
GSC_HD uint32_t lanesOfEye(uint32_t lanes, uint32_t eye)
{
    return lanes >> (16 * eye) & 0xffffu;
}

struct alignas(8) SeenStrip {
    uint32_t lanes, frame; // ListedStrip::lanes in that frame
};

struct alignas(8) KeptWord {
    uint32_t low, high;
};

// A strip as a camera saw it.
struct alignas(16) KeptEntry {
    uint32_t decoded;  // frame
    uint32_t used;     // frame that drew it last
    uint32_t owner;    // ReuseTables::idOf(), or kNoEntry: free
    uint16_t alive;    // Gaussians
    uint16_t positive; // anchors with an opacity above zero
};

// Something that is decoded.
struct alignas(16) Want {
    ListedStrip strip;
    uint32_t index; // index of the strip in the list
    uint32_t eye;   // eye that the entry belongs to
    uint32_t eyes;  // bits of those that draw it
};

// Parameters of one frame: FrameNow, and those of reuse.
struct ReuseNow : FrameNow {
    uint32_t frame;  // counts from 1; a frame drawn again has the same
    uint32_t merged; // other than 0: one entry for both eyes, decoded from look_from (StereoMode::Merged)
    DepthGuidance guidance;
    uint32_t max_depth;
};

// Counters of one frame, cleared before it.
struct ReuseCounters {
    uint32_t strips; // listed
    uint32_t wants;
    uint32_t fresh; // visible anchors that the frame before did not see, of all eyes
    uint32_t evictions;
    uint32_t decoded[kMaxEyes], reused[kMaxEyes]; // anchors
};

// Device pointers.
struct ReuseTables {
    uint32_t strips; // strips of the model
    uint32_t slots;  // at most an entry per strip and eye
    uint32_t room;   // Gaussians of an entry
    ReuseCounters* counters;
    uint32_t* claims;    // slots, behind the counters and cleared with them: ~ of the least idOf() that wants it
    ListedStrip* listed; // strips
    Want* wants;         // kMaxEyes x strips
    SeenStrip* seen[2];  // strips each, per parity of the frame
    KeptEntry* entries;  // slots
    KeptWord* words;     // slots x kKeptWords x room

    // A strip as an eye has it decoded.
    GSC_HD uint32_t idOf(uint32_t strip, uint32_t eye) const { return eye * strips + strip; }
    GSC_HD uint32_t slotOf(uint32_t id) const { return id % slots; }
    // The slot of its entry, or kNoEntry. After decoding, of a strip in view.
    GSC_HD uint32_t keptSlot(uint32_t strip, uint32_t eye) const
    {
        const uint32_t id = idOf(strip, eye), slot = slotOf(id);
        return entries[slot].owner == id ? slot : kNoEntry;
    }
};

struct ScheduleCudaArgs {
    using Now = ReuseNow;

    ReuseNow now;
    const FrameCounters* frame; // after select
    ReuseTables tables;
};

inline void setNow(ScheduleCudaArgs& args, const ReuseNow& now)
{
    args.now = now;
}

// Decides which strips are drawn from entries, and lists those to be decoded. Asynchronous, as all.
void scheduleCuda(const ScheduleCudaArgs& args, uint32_t processors, CUstream_st* stream);
// Then claims slots for strips without one.
void claimCuda(const ScheduleCudaArgs& args, uint32_t processors, CUstream_st* stream);

} // namespace gsc
