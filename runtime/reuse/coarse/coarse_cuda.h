// SPDX-License-Identifier: Apache-2.0
// Coarse copies of the CUDA backend, kept from frame to frame (kernels/coarse/README.md): their memory, and the
// arguments of a frame. The kernels decide everything else (kernels/coarse/coarse_cuda.h).
#pragma once

#include "kernels/coarse/coarse_cuda.h"
#include "runtime/cuda/frame/frame_stages.h"
#include <gsc/renderer.h>

namespace gsc {

class CudaCoarse final : public FrameReuse {
public:
    // `unlimited`: RendererOptions::coarse_unlimited.
    CudaCoarse(MemoryBudget& budget, bool unlimited) : m_arena(budget), m_unlimited(unlimited) {}

    // Loads the kernels now, so that no frame has to wait for them.
    void loadKernels(const DeviceScene& scene) const;
    // Drops all copies and frees their memory. Captured graphs then hold invalid addresses.
    void release();
    // Returns true if prepare() will reserve memory: free graphs and the memory of frames before.
    [[nodiscard]] bool needsMemory() const { return m_arena.bytes() == 0; }
    // Reserves memory for copies: a share of the free memory, from which `others` bytes are subtracted first. Throws
    // Error (OutOfMemory, Device).
    void prepare(const DeviceScene& scene, uint64_t others);

    // Begins a frame; call prepare() before. Returns the arguments for the frame's graph, which live as long as this
    // object. `repeats`: the frame is drawn again after another one began; it then uses the copies that there are, and
    // makes none.
    const CoarseNow& begin(const FrameNow& now, uint32_t eye_count, const FrameOptions& options, bool repeats,
                           uint32_t processors, const CudaStream& stream);
    const CoarseNow& beginAgain(); // for the last frame, if it overflowed and is drawn again: keeps its first decisions

    void listAnchors(FrameCapture& capture, const FrameJob& job) const override;
    void decode(FrameCapture& capture, const FrameJob& job, uint32_t pass) const override;

    [[nodiscard]] uint64_t bytes() const { return m_arena.bytes(); }

private:
    // Returns true if one kernel makes all decisions instead of four. With m_unlimited the four run for small models,
    // too, so that tests can compare both ways.
    [[nodiscard]] bool decidesAtOnce(const DeviceScene& scene) const
    {
        return scene.model().params.group_count <= kCoarseFewGroups && !m_unlimited;
    }
    [[nodiscard]] CoarseCudaArgs cudaArgs(const FrameJob& job, uint32_t pass) const;

    DeviceArena m_arena;
    CoarseTables m_tables{};
    CoarseNow m_now{};
    bool m_unlimited;
    bool m_levels = false;     // result of levelsSwitch() for the model: levels are chosen by distance
    bool m_forget = true;      // true: drop all copies before the next frame
    bool m_any = false;        // true if copies may exist
    int32_t m_appearance = -1; // appearance and fade that the copies were made for
    float m_lod_fade = 0;
};

// Adds the counts of a frame that was drawn with copies.
void addCoarseCounts(const CoarseCounters& counters, uint32_t eye_count, FrameResult& result);

} // namespace gsc
