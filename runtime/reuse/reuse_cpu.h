// SPDX-License-Identifier: Apache-2.0
// Decode and project of a frame that may draw Gaussians decoded for earlier frames (design sections 4 and 5), on a CPU.
#pragma once

#include "kernels/threads/parallel.h"
#include "kernels/select/select.h"
#include "runtime/cpu/frame/decode_state.h"
#include "runtime/view/camera_motion.h"
#include "runtime/reuse/decoded_cache.h"

#include <compare>
#include <vector>

namespace gsc {

// Inputs of a frame, and the state that its stages share.
struct ReuseFrame {
    const EyeParams* eyes;
    uint32_t eye_count;
    const FrameOptions& options;
    RasterConstants rules;
    const SelectScratch& selected;
    const VisibleAnchor* visible; // in the order of selected.groups
    size_t visible_count;
    std::vector<DecodeState>& states; // counts cleared
    SplatStore* stores;               // per eye; a block is a group of groups()
    Buffer<float>& bias;
};

class CpuReuse {
public:
    // `memory`: most bytes of entries where the options set no limit.
    CpuReuse(const Workers& workers, uint64_t memory) : m_workers(workers), m_memory(memory) {}

    // `model` must outlive the next load().
    void load(const ModelView& model);
    void clear();

    // Schedules, decodes and projects; fills the stores, the counts of the states and the cache fields of `result`.
    void run(const ReuseFrame& frame, FrameResult& result);
    void skipFrame(); // called for a frame that is drawn without reuse

    // groups of the last frame, one per block
    [[nodiscard]] const std::vector<uint32_t>& groups() const { return m_groups; }
    [[nodiscard]] uint64_t bytes() const;

private:
    struct LazyStrip;
    // Plan of one eye for one strip.
    struct EyeWork {
        uint32_t slot = kNoSlot;          // best entry to draw; if the strip is decoded, the cache slot it is stored in
        KeptChange drawn = {0, INFINITY}; // predicted change of drawing it, or a bound of it
        Outlook outlook = {0, INFINITY};
        StripKeys plan;           // keys after a decode; the last one is new
        PackedExtent extent = {}; // extent of the entry that it draws or replaces, as the last frame left it
        uint16_t lanes = 0;       // anchors of the strip it sees
        bool due = false;         // the policy wants it decoded
        bool shares = false;      // may draw the other eye's decode of this frame
        bool decode = false;      // the budget grants the decode
    };
    struct StripWork {
        EyeWork eye[kMaxEyes];
    };
    // True if eye `e` draws the strip as the left eye decoded it in this frame.
    [[nodiscard]] static bool drawsShared(const StripWork& work, uint32_t e)
    {
        return work.eye[e].shares && work.eye[0].decode;
    }
    [[nodiscard]] static uint32_t drawnSlot(const StripWork& work, uint32_t e)
    {
        return work.eye[drawsShared(work, e) ? 0 : e].slot;
    }
    struct Seen { // a group, seen by one eye
        uint64_t lanes[kGroupSize / 64] = {};
        uint64_t frame = 0;
    };
    struct Candidate { // strip that is due, in the order in which the budget is spent
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
    std::vector<uint32_t> m_groups;     // per block
    std::vector<uint32_t> m_candidates; // per block: entry of SelectScratch::groups
    std::vector<StripWork> m_work;      // kStripsPerGroup per block
    std::vector<Candidate> m_budgeted;
    std::vector<Seen> m_seen[kMaxEyes];
    std::vector<uint16_t> m_sensitivity; // used if the file has none
    int32_t m_appearance = -1;
    ReusePolicy m_policy = ReusePolicy::None;
    bool m_merged = false; // both eyes share entries, which the first owns
    uint64_t m_frame = 0;
    uint32_t m_depth = 0; // most frames of ReusePolicy::Depth, this frame
    CameraMotion m_motion;
    ReuseRule m_rule;             // rule of this frame
    float m_level[kMaxEyes] = {}; // error at which the budget of the last frame refreshed entries, 0 = it met the bound
};

} // namespace gsc
