// SPDX-License-Identifier: Apache-2.0
// Coarse copies as the CPU backend keeps them from frame to frame (kernels/coarse/README.md), and how a frame draws them.
//
// There is no budget: what is due is made, which costs no more than decoding it as near. So what a frame draws is decided
// by the poses so far, and several workers that saw the same draw the same.
#pragma once

#include "kernels/coarse/coarse_cpu.h"
#include "kernels/present/false_colour.h"
#include "kernels/threads/parallel.h"
#include "runtime/cpu/frame/decode_state.h"

#include <vector>

namespace gsc {

// A frame on its way through the stages.
struct CpuCoarseFrame {
    const EyeParams* eyes;
    const EyeParams* level_eyes; // from where levels are chosen
    uint32_t eye_count;
    const FrameOptions& options;
    const Workers& workers;
    std::vector<DecodeState>& states;
    Buffer<float>& bias;
    const SeenGroup* seen; // groups that the eyes see
    size_t seen_count;
};

class CpuCoarse {
public:
    // `memory`: most bytes of copies where the options set no limit.
    explicit CpuCoarse(uint64_t memory) : m_memory(memory) {}

    // `model` must outlive the next load().
    void load(const ModelView& model);
    void clear();

    // Makes what is due of the groups that the frame has seen, lists what is drawn from its copy. Returns the others,
    // in file order: they are near. Fills the coarse and cache counts of `result`.
    const std::vector<SeenGroup>& choose(const CpuCoarseFrame& frame, FrameResult& result);
    // Projects the copies into the stores' blocks from first_block on, blocks() of them, of `capacity` slots each. After
    // decode: counts the anchors of the copies beside its own.
    void draw(const CpuCoarseFrame& frame, SplatStore* stores, size_t first_block, size_t capacity,
              FrameResult& result) const;

    [[nodiscard]] size_t blocks() const { return m_drawn.size(); } // that the last frame draws
    [[nodiscard]] uint64_t bytes() const
    {
        return m_tile_bytes + m_kept.size() * (sizeof(KeptGroup) + sizeof(Buffer<float>));
    }

private:
    struct Drawn {
        uint32_t group, eyes;
        GroupSource source;
    };

    void chooseDue(const CpuCoarseFrame& frame, FrameResult& result);
    void evict(uint64_t wanted, FrameResult& result);
    void makeGroup(const DecodeArgs& args, const CoarseView& view, const FrameOptions& options, uint32_t index,
                   const CoarseCell& cell, DecodeState& state, JoinScratch& scratch);
    void list(const CpuCoarseFrame& frame, FrameResult& result);
    void addAnchors(uint32_t eye_count, FrameResult& result) const;
    [[nodiscard]] FalseColour colourOf(const FrameOptions& options, const Drawn& drawn) const;
    void drawGroup(SplatStore& store, size_t block, size_t capacity, const ProjectArgs& args,
                   const FrameOptions& options, const Drawn& drawn, uint32_t e, DecodeState& state) const;

    uint64_t m_memory;
    ModelView m_model{};
    std::vector<KeptGroup> m_kept;      // of every group
    std::vector<Buffer<float>> m_tiles; // their copies
    uint64_t m_tile_bytes = 0;          // of the copies
    std::vector<CoarseLook> m_looks;    // of this frame's seen groups
    std::vector<uint32_t> m_due;        // places of those that are made
    std::vector<SeenGroup> m_near;      // of this frame
    std::vector<Drawn> m_drawn;         // from copies
    uint64_t m_anchors[4] = {};         // by GroupSource, of the copies that are drawn
    std::vector<JoinScratch> m_scratch; // per worker
    uint64_t m_frame = 0;
    int32_t m_appearance = -1; // that copies were made for
    float m_fade = 0;          // the same: FrameOptions::lod_fade
};

} // namespace gsc
