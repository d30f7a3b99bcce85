// SPDX-License-Identifier: Apache-2.0
// The order cache of the CUDA backend (kernels/sort/order_cuda.h): its memory, and which half of it is the last frame's.
#pragma once

#include "kernels/common/device_model.h"
#include "runtime/device_buffer.h"

namespace gsc {

// What the launches of a frame need; kDepthBuckets each.
struct OrderJob {
    const uint32_t* known; // or null: there is no last frame
    uint32_t* next;
};

class CudaOrder {
public:
    explicit CudaOrder(MemoryBudget& budget) : m_memory(budget) {}

    // Gives the memory back, too. Whoever has graphs drops them.
    void drop();
    void forget() { m_known = false; } // a frame was drawn that noted nothing

    // Must prepare() move memory? Then graphs and the memory of frames are to be given back before.
    [[nodiscard]] bool needsMemory() const { return m_memory.bytes() == 0; }
    // Throws Error (OutOfMemory, Device).
    void prepare();

    // For a frame that reads and notes, however often it is drawn; then end().
    [[nodiscard]] OrderJob job() const;
    void end();

    [[nodiscard]] bool known() const { return m_known; } // is the last frame's order there?
    [[nodiscard]] uint64_t bytes() const { return m_memory.bytes(); }

private:
    DeviceArena m_memory;
    uint32_t* m_depths[2] = {};
    uint32_t m_last = 0; // half that the last frame noted in
    bool m_known = false;
};

} // namespace gsc
