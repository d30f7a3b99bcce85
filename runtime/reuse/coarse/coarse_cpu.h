// SPDX-License-Identifier: Apache-2.0
// Coarse copies of the CPU backend, kept from frame to frame (kernels/coarse/README.md), and how a frame draws them.
//
// The number of copies made in a frame has no limit: every due copy is made, which takes no longer than decoding the
// group as a near one. So a frame depends only on the poses so far, and workers that saw the same poses draw equal
// pictures.
#pragma once

#include "kernels/coarse/coarse_cpu.h"
#include "kernels/present/false_colour.h"
#include "kernels/threads/parallel.h"
#include "runtime/cpu/frame/decode_state.h"

#include <vector>

namespace gsc {

// Inputs of a frame with coarse copies, and scratch state of its stages.
struct CpuCoarseFrame {
    const EyeParams* eyes;
    const EyeParams* level_eyes; // eyes at the places from which levels are chosen
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
    // `memory`: most bytes of all copies, if the options set no limit.
    explicit CpuCoarse(uint64_t memory) : m_memory(memory) {}

    // `model` must outlive the next load().
    void load(const ModelView& model);
    void clear();

    // Makes the due copies of the groups that the frame sees, and lists the groups to draw from copies. Returns the
    // other groups, which are near, in file order. Sets the counts of copies and of the cache in `result`.
    const std::vector<SeenGroup>& choose(const CpuCoarseFrame& frame, FrameResult& result);
    // Projects the copies into the blocks `first_block` to `first_block` + blocks() - 1 of the stores, each with
    // `capacity` splat slots. Call it after decode: it adds the anchors of the copies to the counts of decode.
    void draw(const CpuCoarseFrame& frame, SplatStore* stores, size_t first_block, size_t capacity,
              FrameResult& result) const;

    [[nodiscard]] size_t blocks() const { return m_drawn.size(); } // number of blocks that the last frame draws
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
    std::vector<KeptGroup> m_kept;      // state of each group
    std::vector<Buffer<float>> m_tiles; // copy of each group, empty = none
    uint64_t m_tile_bytes = 0;          // bytes of all copies
    std::vector<CoarseLook> m_looks;    // decision about each group that the frame sees
    std::vector<uint32_t> m_due;        // indices in CpuCoarseFrame::seen of the groups whose copies are made
    std::vector<SeenGroup> m_near;      // groups that this frame decodes (near) and does not draw from copies
    std::vector<Drawn> m_drawn;         // groups that this frame draws from copies
    uint64_t m_anchors[4] = {};         // number of anchors of the copies drawn, by GroupSource
    std::vector<JoinScratch> m_scratch; // scratch memory for each worker
    uint64_t m_frame = 0;
    int32_t m_appearance = -1; // row of the embedding that the copies were made for
    float m_fade = 0;          // FrameOptions::lod_fade that the copies were made for
};

} // namespace gsc
