// SPDX-License-Identifier: Apache-2.0
// Decoded Gaussians that the CUDA backend keeps from frame to frame (design sections 4 and 5): their memory and what
// the kernels must know of a frame. The kernels decide everything else (kernels/reuse/reuse_cuda.h).
//
// Differences from the CPU's: only ReusePolicy::Depth; frames of more than one pass, which only scarce memory brings
// about, decode everything and keep nothing; a new limit of memory forgets what is kept.
#pragma once

#include "kernels/reuse/reuse_stages_cuda.h"
#include "runtime/cuda/frame/frame_stages.h"
#include <gsc/renderer.h>

namespace gsc {

class CudaReuse final : public FrameReuse {
public:
    explicit CudaReuse(MemoryBudget& budget) : m_cache(budget) {}

    // Forgets everything and gives the memory back. Whoever has graphs drops them.
    void drop();
    // Must prepare() move memory for such a frame? Then graphs and the memory of frames are to be given back before.
    [[nodiscard]] bool needsMemory(const ReuseOptions& reuse, uint32_t eye_count) const;
    // Room for a frame's entries, as many as the options and a quarter of what is free allow. Throws Error (OutOfMemory,
    // Device).
    void prepare(const DeviceScene& scene, const ReuseOptions& reuse, uint32_t eye_count);

    // Begins a frame. After prepare(). Returns what its graph is launched with, as long as this lives.
    const ReuseNow& begin(const FrameNow& now, uint32_t eye_count, const FrameOptions& options, uint32_t flight,
                          const CudaStream& stream);
    const ReuseNow& beginAgain(uint32_t flight); // the frame begun last overflowed
    void skipFrame();                            // a frame is drawn without it

    void prepareFrame(FrameCapture& capture, const FrameJob& job) const override;
    void listAnchors(FrameCapture& capture, const FrameJob& job) const override;
    void decode(FrameCapture& capture, const FrameJob& job, uint32_t pass) const override;
    void report(FrameCapture& capture, const FrameJob& job) const override;

    // Adds the counts of a frame that was drawn with reuse and has ended. Call it in the order in which frames began.
    void addCounts(uint32_t flight, uint32_t eye_count, FrameResult& result);
    [[nodiscard]] uint64_t bytes() const { return m_cache.bytes(); }

private:
    void layOut(ArenaLayout& layout, ReuseTables& tables) const;

    DeviceArena m_cache;
    ReuseTables m_tables{};
    ReuseNow m_now{};
    bool m_again[kFramesInFlight] = {};
    Pinned<ReuseCounters> m_pinned[kFramesInFlight];
    ReuseCounters m_report{}; // of the first time the last frame was drawn
    uint64_t m_limit = 0;     // bytes of entries that m_cache was made for, as the options say
    uint32_t m_eyes = 0;      // the same
    bool m_forget = true;     // before the next frame
    int32_t m_appearance = -1;
};

} // namespace gsc
