// SPDX-License-Identifier: Apache-2.0
// Decoded Gaussians of the CUDA backend, kept from frame to frame (design sections 4 and 5): their memory, and the arguments
// of a frame. The kernels decide everything else (kernels/reuse/reuse_cuda.h).
//
// Differences from the CPU: only ReusePolicy::Depth; frames of more than one pass, which occur only if memory is scarce,
// decode everything and keep nothing; a new limit of memory drops all entries.
#pragma once

#include "kernels/reuse/reuse_stages_cuda.h"
#include "runtime/cuda/frame/frame_stages.h"
#include <gsc/renderer.h>

namespace gsc {

class CudaReuse final : public FrameReuse {
public:
    explicit CudaReuse(MemoryBudget& budget) : m_cache(budget) {}

    // Drops all entries and gives the memory back. Captured graphs are then invalid.
    void drop();
    // True if prepare() will take other memory for such a frame: give back graphs and the memory of frames before.
    [[nodiscard]] bool needsMemory(const ReuseOptions& reuse, uint32_t eye_count) const;
    // Takes memory for entries, as much as the options and a quarter of the free memory allow. Throws Error (OutOfMemory,
    // Device).
    void prepare(const DeviceScene& scene, const ReuseOptions& reuse, uint32_t eye_count);

    // Begins a frame, after prepare(). Returns the arguments to launch its graph with, which live as long as this.
    const ReuseNow& begin(const FrameNow& now, uint32_t eye_count, const FrameOptions& options, uint32_t flight,
                          const CudaStream& stream);
    const ReuseNow& beginAgain(uint32_t flight); // the last frame overflowed and is drawn again
    void skipFrame();                            // called for a frame that is drawn without reuse

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
    ReuseCounters m_report{}; // counters of the first try of the last frame
    uint64_t m_limit = 0;     // limit of the options that m_cache was made for, bytes
    uint32_t m_eyes = 0;      // eyes that m_cache was made for
    bool m_forget = true;     // drop all entries before the next frame
    int32_t m_appearance = -1;
};

} // namespace gsc
