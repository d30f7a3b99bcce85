// SPDX-License-Identifier: Apache-2.0
// The stages of a frame on a CPU: from anchors, or from Gaussians that the caller has, to the lists of splats that
// blendCpu() takes. Used for pictures, for the importance of a bake and for pictures of exported Gaussians.
#pragma once

#include "kernels/blend/blend.h"
#include "kernels/threads/parallel.h"
#include "runtime/cpu/frame/decode_state.h"

namespace gsc {

// A frame on a CPU. Its stages are called in the order of the functions below. All throw Error(OutOfMemory).
struct CpuFrame {
    explicit CpuFrame(int threads) : workers(threads), states(size_t(workers.count())) {} // threads = 0 uses all cores

    // `from` must outlive the next load(). A frame that draws only the caller's Gaussians needs no model.
    void load(const ModelView& from);

    // Finds the anchors that `eye_count` eyes see; levels are chosen by the distance from the centres of `eyes`.
    void select(const EyeParams* eyes, uint32_t eye_count, const FrameOptions& options, FrameResult& result);
    // Do the work of select() in two steps. The first lists in selected.seen the groups that the eyes may see and
    // returns their number; the second finds the visible anchors of `groups`.
    size_t selectGroups(const EyeParams* eyes, uint32_t eye_count, const FrameOptions& options, FrameResult& result);
    void selectAnchors(const EyeParams* eyes, uint32_t eye_count, const FrameOptions& options,
                       const std::vector<SeenGroup>& groups, FrameResult& result);
    // Fills the stores with splats of the visible anchors, block by block, so that Gaussians never leave the cache.
    // `more_blocks`: number of blocks behind those for which the stores get room.
    void decode(const EyeParams* eyes, uint32_t eye_count, const FrameOptions& options, FrameResult& result,
                size_t more_blocks = 0);
    // Lists the splats in the first `blocks` blocks of eye `e`'s store by tile, from near to far. `groups` is the
    // group of each block, if blocks are groups, else null. Splats of equal depth keep their order if there is no
    // model, and in blocks from `ordered_blocks` on. Returns the number of splats.
    size_t list(uint32_t e, const EyeParams& eye, size_t blocks, const uint32_t* groups, FrameResult& result,
                size_t ordered_blocks = UINT32_MAX);
    // Returns the arguments for blending the listed splats of `eye`. The caller adds those that only some uses of
    // blending need.
    [[nodiscard]] BlendArgs listed(const EyeParams& eye, const RasterConstants& rules) const;

    // Number of blocks that decode() works on.
    [[nodiscard]] size_t blocks() const { return (visible_count + kDecodeBlock - 1) / kDecodeBlock; }
    void checkSlots(size_t anchors) const; // throws if the slots of so many anchors cannot be numbered with 32 bits
    [[nodiscard]] uint64_t bytes() const;

    Workers workers;
    std::vector<DecodeState> states; // a state for each worker; select() clears the counts
    ModelView model{};
    uint32_t capacity = 0; // number of slots of a block
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
