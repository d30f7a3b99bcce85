// SPDX-License-Identifier: Apache-2.0
// A frame on a CPU, stage by stage: from anchors, or from Gaussians that somebody else has, to the lists of splats that
// blendCpu() takes. Pictures, importance of a bake and pictures of exported Gaussians all come from here.
#pragma once

#include "kernels/blend/blend.h"
#include "kernels/threads/parallel.h"
#include "runtime/cpu/frame/decode_state.h"

namespace gsc {

// A frame runs its stages in the order that they stand here. All throw Error(OutOfMemory).
struct CpuFrame {
    explicit CpuFrame(int threads) : workers(threads), states(size_t(workers.count())) {} // 0 = all cores

    // `from` must outlive the next load(). A frame of Gaussians alone needs none.
    void load(const ModelView& from);

    // Finds the anchors that `eye_count` eyes see; levels are chosen from the centres of `eyes`.
    void select(const EyeParams* eyes, uint32_t eye_count, const FrameOptions& options, FrameResult& result);
    // Do select() in two steps. The first lists in selected.seen the groups that the eyes may see and returns how many;
    // the second finds the anchors that they see of `groups`.
    size_t selectGroups(const EyeParams* eyes, uint32_t eye_count, const FrameOptions& options, FrameResult& result);
    void selectAnchors(const EyeParams* eyes, uint32_t eye_count, const FrameOptions& options,
                       const std::vector<SeenGroup>& groups, FrameResult& result);
    // Fills the stores from those anchors, block by block so that Gaussians never leave the cache. more_blocks: that the
    // stores get room for behind those.
    void decode(const EyeParams* eyes, uint32_t eye_count, const FrameOptions& options, FrameResult& result,
                size_t more_blocks = 0);
    // Lists the splats of the first `blocks` blocks of eye `e`'s store by tile, from near to far. `groups`: group of
    // each block, if blocks are groups. Splats of equal depth keep their order without a model, and in blocks from
    // ordered_blocks on. Returns the number of splats.
    size_t list(uint32_t e, const EyeParams& eye, size_t blocks, const uint32_t* groups, FrameResult& result,
                size_t ordered_blocks = UINT32_MAX);
    // Arguments to blend the listed splats of `eye` with. The caller adds the members that only its blending needs.
    [[nodiscard]] BlendArgs listed(const EyeParams& eye, const RasterConstants& rules) const;

    // blocks that decode() works on
    [[nodiscard]] size_t blocks() const { return (visible_count + kDecodeBlock - 1) / kDecodeBlock; }
    void checkSlots(size_t anchors) const; // splats are numbered with 32 bits
    [[nodiscard]] uint64_t bytes() const;

    Workers workers;
    std::vector<DecodeState> states; // per worker; cleared by select()
    ModelView model{};
    uint32_t capacity = 0; // slots of a block
    SelectScratch selected;
    Buffer<VisibleAnchor> visible;
    size_t visible_count = 0;
    Buffer<float> bias;
    SplatStore stores[kMaxEyes];
    SortScratch sort;
    BinScratch bin;

private:
    void beginCounts(const SelectCounts& counts, uint32_t eye_count, FrameResult& result);
    void decodeBlock(const DecodeArgs& args, const EyeParams* eyes, uint32_t eye_count, const RasterConstants& rules,
                     const FrameOptions& options, size_t block, DecodeState& state);
};

} // namespace gsc
