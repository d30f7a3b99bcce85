// SPDX-License-Identifier: Apache-2.0
// Decoded Gaussians of the CUDA backend, kept from frame to frame (design sections 4 and 5): their memory, and the
// arguments of a frame. The kernels decide everything else (kernels/reuse/reuse_cuda.h).
//
// Differences from the CPU backend: there is only ReusePolicy::Depth; a frame of more than one pass, which happens
// only if memory is short, decodes everything and keeps nothing; a new limit of memory drops all entries.
#pragma once

#include "kernels/reuse/reuse_stages_cuda.h"
#include "runtime/cuda/frame/frame_stages.h"
#include <gsc/renderer.h>

namespace gsc {

class CudaReuse final : public FrameReuse {
public:
    explicit CudaReuse(MemoryBudget& budget) : m_cache(budget) {}

    // Drops all entries and frees their memory. Captured graphs then hold invalid addresses.
    void drop();
    // Returns true if prepare() will reserve other memory for a frame with these settings: free graphs and the memory
    // of frames before.
    [[nodiscard]] bool needsMemory(const ReuseOptions& reuse, uint32_t eye_count) const;
    // Reserves memory for entries, within the limit of the options and a quarter of the free memory. Throws Error
    // (OutOfMemory, Device).
    void prepare(const DeviceScene& scene, const ReuseOptions& reuse, uint32_t eye_count);

    // Begins a frame; call prepare() before. Returns the arguments for the frame's graph, which live as long as this
    // object.
    const ReuseNow& begin(const FrameNow& now, uint32_t eye_count, const FrameOptions& options, uint32_t flight,
                          const CudaStream& stream);
    const ReuseNow& beginAgain(uint32_t flight); // for the last frame, if it overflowed and is drawn again
    void skipFrame();                            // call it for a frame that is drawn without reuse

    void prepareFrame(FrameCapture& capture, const FrameJob& job) const override;
    void listAnchors(FrameCapture& capture, const FrameJob& job) const override;
    void decode(FrameCapture& capture, const FrameJob& job, uint32_t pass) const override;
    void report(FrameCapture& capture, const FrameJob& job) const override;

    // Adds the counts of a frame that was drawn with reuse and has ended. Call it in the order in which the frames
    // began.
    void addCounts(uint32_t flight, uint32_t eye_count, FrameResult& result);
    [[nodiscard]] uint64_t bytes() const { return m_cache.bytes(); }

private:
    void layOut(ArenaLayout& layout, ReuseTables& tables) const;

    DeviceArena m_cache;
    ReuseTables m_tables{};
    ReuseNow m_now{};
    bool m_again[kFramesInFlight] = {};
    Pinned<ReuseCounters> m_pinned[kFramesInFlight];
    ReuseCounters m_report{}; // counters of the last frame's first try, if the frame was drawn again
    uint64_t m_limit = 0;     // limit in the options for which m_cache was made, bytes
    uint32_t m_eyes = 0;      // number of eyes for which m_cache was made
    bool m_forget = true;     // true: drop all entries before the next frame
    int32_t m_appearance = -1;
};

} // namespace gsc
