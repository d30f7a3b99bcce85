// SPDX-License-Identifier: Apache-2.0
// Decode and project of a frame on a CPU that may draw Gaussians decoded for earlier frames (design sections 4 and 5).
#pragma once

#include "kernels/threads/parallel.h"
#include "kernels/select/select.h"
#include "runtime/cpu/frame/decode_state.h"
#include "runtime/view/camera_motion.h"
#include "runtime/reuse/decoded_cache.h"

#include <compare>
#include <vector>

namespace gsc {

// Inputs of a frame with reuse, and scratch state of its stages.
struct ReuseFrame {
    const EyeParams* eyes;
    uint32_t eye_count;
    const FrameOptions& options;
    RasterConstants rules;
    const SelectScratch& selected;
    const VisibleAnchor* visible; // visible anchors in the order of selected.groups
    size_t visible_count;
    std::vector<DecodeState>& states; // states of the workers; the counts are 0 at the start
    SplatStore* stores;               // stores of the eyes; each block is a group of groups()
    Buffer<float>& bias;
};

class CpuReuse {
public:
    // `memory`: most bytes of all entries, if the options set no limit.
    CpuReuse(const Workers& workers, uint64_t memory) : m_workers(workers), m_memory(memory) {}

    // `model` must outlive the next load().
    void load(const ModelView& model);
    void clear();

    // Schedules, decodes and projects the frame. Fills the stores, the counts in the states and the cache fields of
    // `result`.
    void run(const ReuseFrame& frame, FrameResult& result);
    void skipFrame(); // call it for a frame that is drawn without reuse

    // Groups of the last frame, one for each block.
    [[nodiscard]] const std::vector<uint32_t>& groups() const { return m_groups; }
    [[nodiscard]] uint64_t bytes() const;

private:
    struct LazyStrip;
    // Plan for one strip and one eye.
    struct EyeWork {
        uint32_t slot = kNoSlot; // slot of the best entry to draw; if the strip is decoded, the slot that receives it
        KeptChange drawn = {0, INFINITY}; // predicted error of drawing the entry, or an upper bound of it
        Outlook outlook = {0, INFINITY};
        StripKeys plan;           // keys of the entry after a decode; the last one is new
        PackedExtent extent = {}; // PackedExtent, as of the last frame, of the entry that is drawn or replaced
        uint16_t lanes = 0;       // bit mask of the strip's anchors that the eye sees
        bool due = false;         // true if the policy asks for a decode
        bool shares = false;      // true if the eye may draw what the other eye decodes in this frame
        bool decode = false;      // true if the decode is within the budget
    };
    struct StripWork {
        EyeWork eye[kMaxEyes];
    };
    // Returns true if eye `e` draws the strip as the left eye decoded it in this frame.
    [[nodiscard]] static bool drawsShared(const StripWork& work, uint32_t e)
    {
        return work.eye[e].shares && work.eye[0].decode;
    }
    [[nodiscard]] static uint32_t drawnSlot(const StripWork& work, uint32_t e)
    {
        return work.eye[drawsShared(work, e) ? 0 : e].slot;
    }
    struct Seen { // anchors of a group that one eye saw last, and the frame
        uint64_t lanes[kGroupSize / 64] = {};
        uint64_t frame = 0;
    };
    struct Candidate { // a strip that is due; sorted in the order in which the budget is spent
        uint32_t bucket, split, work;

        auto operator<=>(const Candidate&) const = default;
    };

    void listGroups(const ReuseFrame& frame);
    [[nodiscard]] float updateRate(const ReuseFrame& frame);
    void scheduleBlock(const ReuseFrame& frame, size_t block);
    void scheduleByDepth(const ReuseFrame& frame, uint32_t id, StripWork& work);
    void scheduleByError(uint32_t eye_count, LazyStrip& strip, StripWork& work);
    bool chooseOwn(LazyStrip& strip, uint32_t e, uint32_t seen, float cover, EyeWork& eye);
    bool chooseOther(LazyStrip& strip, uint32_t e, uint32_t seen, float cover, EyeWork& eye);
    const StripKeys& widened(uint32_t slot, LazyStrip& strip, uint32_t lanes);
    float leadKey(LazyStrip& strip, uint32_t e, float rate, float target, StripKeys& keys) const;
    StripKeys planFor(LazyStrip& strip, uint32_t e, const EyeWork& eye, uint32_t seen, float cover) const;
    void grant(const ReuseFrame& frame);
    void drawBlock(const ReuseFrame& frame, const DecodeArgs& args, size_t block, DecodeState& state);
    void decodeStrip(const ReuseFrame& frame, const DecodeArgs& args, size_t block, uint32_t strip,
                     const StripWork& work, DecodeState& state);
    void drawStrip(const ReuseFrame& frame, uint32_t strip, uint32_t e, const StripWork& work, const float* fraction,
                   DecodeState& state) const;
    void groupFractions(const ReuseFrame& frame, const GroupMask& mask, float (*fraction)[kGroupSize]) const;
    void paintBlock(const ReuseFrame& frame, size_t block, uint32_t e, Splat* splats, const uint16_t* origins,
                    uint32_t count) const;
    void noteCover(const ReuseFrame& frame, size_t block, uint32_t e, const Splat* splats, const uint16_t* origins,
                   uint32_t count);
    void giveSlots(const ReuseFrame& frame, uint64_t limit);
    [[nodiscard]] const uint16_t* sensitivity() const
    {
        return m_model.sensitivity != nullptr ? m_model.sensitivity : m_sensitivity.data();
    }
    [[nodiscard]] uint32_t stripId(size_t work) const
    {
        return m_groups[work / kStripsPerGroup] * kStripsPerGroup + uint32_t(work % kStripsPerGroup);
    }
    void reserveStrip(DecodeState& state) const;
    void lookAhead(size_t work, ReadAhead& ahead) const;
    [[nodiscard]] uint32_t stripAnchors(size_t block, uint32_t strip) const;

    const Workers& m_workers;
    uint64_t m_memory;
    ModelView m_model{};
    DecodedCache m_cache;
    std::vector<uint32_t> m_groups;     // group of each block
    std::vector<uint32_t> m_candidates; // index in SelectScratch::groups of each block
    std::vector<StripWork> m_work;      // work for each strip: kStripsPerGroup entries for each block
    std::vector<Candidate> m_budgeted;
    std::vector<Seen> m_seen[kMaxEyes];
    std::vector<uint16_t> m_sensitivity; // sensitivities, computed if the file has none
    int32_t m_appearance = -1;
    ReusePolicy m_policy = ReusePolicy::None;
    bool m_merged = false; // true if both eyes draw the first eye's entries
    uint64_t m_frame = 0;
    uint32_t m_depth = 0; // with ReusePolicy::Depth: most frames that an entry is drawn in, for this frame
    CameraMotion m_motion;
    ReuseRule m_rule; // rule of ReusePolicy::Error for this frame
    // error down to which the last frame's budget refreshed entries, for each eye; 0 = all within the bound
    float m_level[kMaxEyes] = {};
};

} // namespace gsc
