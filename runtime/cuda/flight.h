// SPDX-License-Identifier: Apache-2.0
// A frame of the CUDA renderer from submit() to the wait() that ends it: its own state, beside the buffers that all
// frames share.
#pragma once

#include "runtime/cuda/frame/frame_graph.h"
#include <gsc/renderer.h>

#include <deque>
#include <exception>
#include <memory>

namespace gsc {

struct Flight {
    explicit Flight(MemoryBudget& budget) : m_pictures(budget) {}

    // Sets the targets of the next frame. Returns the bytes of its pictures for the host.
    uint64_t setTargets(const FrameRequest& request);
    [[nodiscard]] uint64_t pictureBytes() const { return m_pictures.bytes(); } // reserved bytes
    void placePictures()                                                       // Throws Error (OutOfMemory, Device)
    {
        layOutIn(m_pictures, "the pictures", [this](ArenaLayout& layout) { layOut(layout); });
    }
    // Asynchronous, behind the frame's graph.
    void present(const FrameBuffers& buffers, const CudaStream& stream);

    // True if the frame has been drawn. Waits at most `most` for it.
    [[nodiscard]] bool passed(std::chrono::nanoseconds most) const;
    // Fills the targets on the host. Precondition: the frame is drawn.
    [[nodiscard]] std::exception_ptr copyToHost(const CudaStream& stream) const; // the error, or null
    void fillResult();                                                           // times and counts alone

    uint64_t ticket = 0; // 0 = free
    bool ended = false;  // `result` and targets on the host are filled
    FrameShape shape{};
    FrameResult result;
    uint64_t anchors_absent = 0; // when it was submitted
    bool overflowed = false;
    std::exception_ptr error{}; // error of the copy to the host
    Pinned<FrameCounters> counters;
    bool presents = false;         // there are targets
    CudaEvent start, drawn, ready; // before its graph; where it presents, behind its images; behind all
    std::deque<std::unique_ptr<FrameGraph>> graphs; // the last used first

private:
    void layOut(ArenaLayout& layout);

    uint32_t m_eye_count = 0;
    uint32_t m_height[kMaxEyes] = {};
    ColumnRange m_columns[kMaxEyes] = {}; // columns of each eye that are drawn
    LensShape m_lens[kMaxEyes];
    FrameTarget m_wanted[kMaxEyes] = {}, m_written[kMaxEyes] = {}; // targets of the caller; targets of the device
    DeviceArena m_pictures;                                        // pictures for the host, in the format wanted
};

} // namespace gsc
