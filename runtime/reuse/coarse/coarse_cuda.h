// SPDX-License-Identifier: Apache-2.0
// Coarse copies of the CUDA backend, kept from frame to frame (kernels/coarse/README.md): their memory, and the arguments of
// a frame. The kernels decide everything else (kernels/coarse/coarse_cuda.h).
#pragma once

#include "kernels/coarse/coarse_cuda.h"
#include "runtime/cuda/frame/frame_stages.h"
#include <gsc/renderer.h>

namespace gsc {

class CudaCoarse final : public FrameReuse {
public:
    // unlimited: RendererOptions::coarse_unlimited.
    CudaCoarse(MemoryBudget& budget, bool unlimited) : m_arena(budget), m_unlimited(unlimited) {}

    // Loads the kernels now, so that no frame waits for them.
    void loadKernels(const DeviceScene& scene) const;
    // Forgets all copies and gives the memory back. Captured graphs are then invalid.
    void release();
    // True if prepare() will take memory: give back graphs and the memory of frames before.
    [[nodiscard]] bool needsMemory() const { return m_arena.bytes() == 0; }
    // Takes memory for copies: a share of the free memory, less `others` bytes. Throws Error (OutOfMemory, Device).
    void prepare(const DeviceScene& scene, uint64_t others);

    // Begins a frame, after prepare(). Returns the arguments to launch its graph with, which live as long as this. repeats:
    // the frame is drawn again after another was begun: from the copies there are, and none is made.
    const CoarseNow& begin(const FrameNow& now, uint32_t eye_count, const FrameOptions& options, bool repeats,
                           uint32_t processors, const CudaStream& stream);
    const CoarseNow& beginAgain(); // the last frame overflowed and is drawn again by its first decisions

    void listAnchors(FrameCapture& capture, const FrameJob& job) const override;
    void decode(FrameCapture& capture, const FrameJob& job, uint32_t pass) const override;

    [[nodiscard]] uint64_t bytes() const { return m_arena.bytes(); }

private:
    // True if one kernel decides instead of four. With m_unlimited the four run for small models too, so that tests can
    // compare both ways.
    [[nodiscard]] bool decidesAtOnce(const DeviceScene& scene) const
    {
        return scene.model().params.group_count <= kCoarseFewGroups && !m_unlimited;
    }
    [[nodiscard]] CoarseCudaArgs cudaArgs(const FrameJob& job, uint32_t pass) const;

    DeviceArena m_arena;
    CoarseTables m_tables{};
    CoarseNow m_now{};
    bool m_unlimited;
    bool m_levels = false;     // levelsSwitch() of the model
    bool m_forget = true;      // forget all copies before the next frame
    bool m_any = false;        // there may be copies
    int32_t m_appearance = -1; // copies were made for this appearance and this fade
    float m_lod_fade = 0;
};

// Adds the counts of a frame that was drawn with copies.
void addCoarseCounts(const CoarseCounters& counters, uint32_t eye_count, FrameResult& result);

} // namespace gsc
