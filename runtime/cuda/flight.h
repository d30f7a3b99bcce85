// SPDX-License-Identifier: Apache-2.0
// State of one frame of the CUDA renderer from submit() to the wait() that ends it. Frames also share buffers, which
// are not in here.
#pragma once

#include "runtime/cuda/frame/frame_graph.h"
#include <gsc/renderer.h>

#include <deque>
#include <exception>
#include <memory>

namespace gsc {

struct Flight {
    explicit Flight(MemoryBudget& budget) : m_pictures(budget) {}

    // Sets the targets of the next frame. Returns the bytes that its pictures for the host take on the device.
    uint64_t setTargets(const FrameRequest& request);
    [[nodiscard]] uint64_t pictureBytes() const { return m_pictures.bytes(); } // bytes reserved for the pictures
    void placePictures()                                                       // throws Error (OutOfMemory, Device)
    {
        layOutIn(m_pictures, "the pictures", [this](ArenaLayout& layout) { layOut(layout); });
    }
    // Enqueues the conversion of the pictures to their targets, behind the frame's graph.
    void present(const FrameBuffers& buffers, const CudaStream& stream);

    // Waits up to `most` for the frame. Returns true if it has been drawn.
    [[nodiscard]] bool passed(std::chrono::nanoseconds most) const;
    // Copies pictures to the targets on the host. Precondition: the frame is drawn.
    [[nodiscard]] std::exception_ptr copyToHost(const CudaStream& stream) const; // returns the error of a copy, or null
    void fillResult();                                                           // sets times and counts in `result`

    uint64_t ticket = 0; // ticket of the frame; 0 = no frame is in flight here
    bool ended = false;  // true once `result` and the targets on the host are filled
    FrameShape shape{};
    FrameResult result;
    uint64_t anchors_absent = 0; // number of anchors that were not on the device when the frame was submitted
    bool overflowed = false;
    std::exception_ptr error{}; // error of copying pictures to the host, null = none
    Pinned<FrameCounters> counters;
    bool presents = false; // true if the frame has targets to fill
    // passed before the frame's graph; behind the graph, or the pictures if it presents; behind everything
    CudaEvent start, drawn, ready;
    std::deque<std::unique_ptr<FrameGraph>> graphs; // graphs of different shapes, the last used first

private:
    void layOut(ArenaLayout& layout);

    uint32_t m_eye_count = 0;
    uint32_t m_height[kMaxEyes] = {};
    ColumnRange m_columns[kMaxEyes] = {}; // range of columns that is drawn, for each eye
    LensShape m_lens[kMaxEyes];
    // targets of the caller; targets that the device writes
    FrameTarget m_wanted[kMaxEyes] = {}, m_written[kMaxEyes] = {};
    DeviceArena m_pictures; // pictures for the host, in their final format
};

} // namespace gsc
