// SPDX-License-Identifier: Apache-2.0
// The cut cache of the CUDA backend (design section 5): its memory, and where the eyes have been.
#pragma once

#include "kernels/select/select_cuda.h"
#include "runtime/cuda_device.h"
#include "runtime/device_buffer.h"

namespace gsc {

class CudaCut {
public:
    explicit CudaCut(MemoryBudget& budget) : m_cache(budget) {}

    // Forgets everything; drop() gives the memory back, too, and whoever has graphs drops them.
    void forget();
    void drop();
    // Must prepare() move memory for such a frame? Then graphs and the memory of frames are to be given back before.
    [[nodiscard]] bool needsMemory(uint32_t eye_count) const { return eye_count > m_eyes; }
    // Throws Error (OutOfMemory, Device).
    void prepare(uint32_t group_count, uint32_t eye_count);

    // Begins a frame with the eyes as select takes them. After prepare(). Asynchronous.
    void begin(const ModelParams& params, const EyeParams* eyes, uint32_t eye_count, const RasterConstants& rules,
               float lod_bias, const CudaStream& stream);

    [[nodiscard]] const CutArgs& args() const { return m_args; }
    [[nodiscard]] uint64_t bytes() const { return m_cache.bytes(); }

private:
    DeviceArena m_cache;
    CutPoses m_poses[kMaxEyes];
    CutArgs m_args{};
    uint32_t m_groups = 0, m_eyes = 0; // that m_cache was made for
};

} // namespace gsc
