// SPDX-License-Identifier: Apache-2.0
// Coarse copies of the CPU backend, kept from frame to frame (kernels/coarse/README.md), and how a frame draws them.
//
// There is no budget: every due copy is made, which costs no more than decoding the group as near. So a frame depends on
// the poses so far only, and workers that saw the same poses draw the same picture.
#pragma once

#include "kernels/coarse/coarse_cpu.h"
#include "kernels/present/false_colour.h"
#include "kernels/threads/parallel.h"
#include "runtime/cpu/frame/decode_state.h"

#include <vector>

namespace gsc {

// Inputs of a frame, and the state that its stages share.
struct CpuCoarseFrame {
    const EyeParams* eyes;
    const EyeParams* level_eyes; // eyes at the places that levels are chosen from
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

    // Makes the due copies of the groups that the frame sees, and lists the groups drawn from copies. Returns the others,
    // the near groups, in file order. Fills the coarse and cache counts of `result`.
    const std::vector<SeenGroup>& choose(const CpuCoarseFrame& frame, FrameResult& result);
    // Projects the copies into blocks() blocks of the stores, from first_block on, of `capacity` splat slots each.
    // Called after decode, to whose counts it adds the anchors of the copies.
    void draw(const CpuCoarseFrame& frame, SplatStore* stores, size_t first_block, size_t capacity,
              FrameResult& result) const;

    [[nodiscard]] size_t blocks() const { return m_drawn.size(); } // blocks that the last frame draws
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
    std::vector<KeptGroup> m_kept;      // state of every group
    std::vector<Buffer<float>> m_tiles; // copy of every group
    uint64_t m_tile_bytes = 0;          // bytes of all copies
    std::vector<CoarseLook> m_looks;    // decision about each group that the frame sees
    std::vector<uint32_t> m_due;        // indices, in `seen`, of the groups whose copies are made
    std::vector<SeenGroup> m_near;      // near groups of this frame
    std::vector<Drawn> m_drawn;         // groups drawn from copies
    uint64_t m_anchors[4] = {};         // anchors of the copies drawn, by GroupSource
    std::vector<JoinScratch> m_scratch; // per worker
    uint64_t m_frame = 0;
    int32_t m_appearance = -1; // appearance that copies were made for
    float m_fade = 0;          // FrameOptions::lod_fade that copies were made for
};

} // namespace gsc
