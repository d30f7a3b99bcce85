// SPDX-License-Identifier: Apache-2.0
// Coarse copies as the CUDA backend keeps them from frame to frame (kernels/coarse/README.md): its memory and what the
// kernels must know of a frame. They decide everything else (kernels/coarse/coarse_cuda.h).
#pragma once

#include "kernels/coarse/coarse_cuda.h"
#include "runtime/cuda/frame/frame_stages.h"
#include <gsc/renderer.h>

namespace gsc {

class CudaCoarse final : public FrameReuse {
public:
    // unlimited: RendererOptions::coarse_unlimited.
    CudaCoarse(MemoryBudget& budget, bool unlimited) : m_arena(budget), m_unlimited(unlimited) {}

    // So that no frame waits for them.
    void loadKernels(const DeviceScene& scene) const;
    // Forgets everything and gives the memory back. Whoever has graphs drops them.
    void release();
    // Must prepare() take memory? Then graphs and the memory of frames are to be given back before.
    [[nodiscard]] bool needsMemory() const { return m_arena.bytes() == 0; }
    // Room for the copies of the model, as many as a share of what is free allows, less `others` bytes. Throws Error
    // (OutOfMemory, Device).
    void prepare(const DeviceScene& scene, uint64_t others);

    // Begins a frame. After prepare(). Returns what its graph is launched with, as long as this lives. repeats: it is drawn
    // again after another was begun: from the copies there are, and none is made.
    const CoarseNow& begin(const FrameNow& now, uint32_t eye_count, const FrameOptions& options, bool repeats,
                           uint32_t processors, const CudaStream& stream);
    const CoarseNow& beginAgain(); // the frame begun last overflowed; nothing is decided anew

    void listAnchors(FrameCapture& capture, const FrameJob& job) const override;
    void decode(FrameCapture& capture, const FrameJob& job, uint32_t pass) const override;

    [[nodiscard]] uint64_t bytes() const { return m_arena.bytes(); }

private:
    // Whether one kernel decides. Workers that share poses take the four kernels of large models: tests hold both ways
    // against each other with one small model.
    [[nodiscard]] bool decidesAtOnce(const DeviceScene& scene) const
    {
        return scene.model().params.group_count <= kCoarseFewGroups && !m_unlimited;
    }
    [[nodiscard]] CoarseCudaArgs cudaArgs(const FrameJob& job, uint32_t pass) const;

    DeviceArena m_arena;
    CoarseTables m_tables{};
    CoarseNow m_now{};
    bool m_unlimited;
    bool m_levels = false;     // of the model: levelsSwitch()
    bool m_forget = true;      // before the next frame
    bool m_any = false;        // may there be copies?
    int32_t m_appearance = -1; // that copies were made for, as is the fade
    float m_lod_fade = 0;
};

// Adds what a frame drew, of one that was drawn with copies.
void addCoarseCounts(const CoarseCounters& counters, uint32_t eye_count, FrameResult& result);

} // namespace gsc
