// SPDX-License-Identifier: Apache-2.0
// What the CUDA backend keeps of decoded Gaussians from frame to frame (design sections 4 and 5): its memory and what the
// kernels must know of a frame. They decide everything else (kernels/schedule/reuse_cuda.h).
//
// Unlike the CPU's: a refresh decodes both keys anew, the first from where the camera is, in place of going on from the
// last key, and counts as two decodes; frames of more than one pass, which only scarce memory brings about, decode
// everything and keep nothing; a new limit of memory forgets what is kept.
#pragma once

#include "kernels/decode/decode_cuda.h"
#include "runtime/camera_motion.h"
#include "runtime/cuda_device.h"
#include "runtime/device_buffer.h"
#include "runtime/device_scene.h"

#include <cstddef>

namespace gsc {

// What the host reads of a frame.
struct ReuseReport {
    ReuseState state;
    ReuseCounters counters;
};

static_assert(offsetof(ReuseReport, counters) == offsetof(ReuseScratch, counters)); // copied in one piece

// What the launches of a frame need.
struct ReuseJob {
    ReuseTables tables;
    const uint32_t* sensitivity; // per anchor, or null
    bool ample;
    ReuseNow now;
    ReuseReport* report; // page-locked
};

class CudaReuse {
public:
    explicit CudaReuse(MemoryBudget& budget);
    ~CudaReuse();
    CudaReuse(const CudaReuse&) = delete;
    CudaReuse& operator=(const CudaReuse&) = delete;

    // Forget everything, or what frames left but not what is known of the model, and give the memory back. Whoever has
    // graphs drops them.
    void release();
    void drop();
    // Must prepare() move memory for such a frame? Then graphs and the memory of frames are to be given back before.
    [[nodiscard]] bool needsMemory(const ReuseOptions& reuse, uint32_t eye_count) const;
    // Room for a frame's entries, as many as the options and a quarter of what is free allow, and what the policy reads.
    // Throws Error (OutOfMemory, Device).
    void prepare(const DeviceScene& scene, const ReuseOptions& reuse, uint32_t eye_count, const CudaStream& stream);

    // Begins a frame. After prepare().
    void begin(const EyeParams* eyes, uint32_t eye_count, const FrameOptions& options, const CudaStream& stream);
    void endTry();    // it was drawn; if it is drawn again, nothing is decided anew
    void skipFrame(); // a frame was drawn without it

    [[nodiscard]] const ReuseJob& job() const { return m_job; }
    [[nodiscard]] static bool budgeted(const ReuseOptions& reuse);

    // Of the frame begun last, drawn with it and ended.
    void addCounts(uint32_t eye_count, FrameResult& result);
    [[nodiscard]] uint64_t bytes() const { return m_cache.bytes(); }

private:
    void layOut(ArenaLayout& layout, ReuseTables& tables) const;

    DeviceArena m_cache, m_sensitivity;
    ReuseJob m_job{};
    ReuseReport m_report{}; // of the first time the last frame was drawn
    CameraMotion m_motion;
    uint64_t m_limit = 0;     // bytes of entries that m_cache was made for, as the options say
    uint32_t m_eyes = 0;      // the same
    bool m_forget = true;     // before the next frame
    uint32_t m_evictions = 0; // ReuseState, after the last frame
    int32_t m_appearance = -1;
    ReusePolicy m_policy = ReusePolicy::None;
};

} // namespace gsc
