// SPDX-License-Identifier: Apache-2.0
// The thread that draws the frames of a renderer on the host, so that submit() does not wait for them.
#pragma once

#include "kernels/simd/buffer.h"
#include <gsc/renderer.h>

#include <condition_variable>
#include <deque>
#include <exception>
#include <functional>
#include <mutex>
#include <thread>

namespace gsc {

class FrameThread {
public:
    // Function that draws a frame, on the thread, or in submit() if the system gives no thread. `images` and `depths`
    // have an entry for each eye; null = not wanted.
    using Draw = std::function<void(const EyeParams* eyes, uint32_t eye_count, const FrameOptions& options,
                                    float* const* images, FrameResult& result, const DepthRows<float>* depths)>;

    explicit FrameThread(Draw draw);
    ~FrameThread(); // the destructor drops frames that have not begun
    FrameThread(const FrameThread&) = delete;
    FrameThread& operator=(const FrameThread&) = delete;

    // These implement the functions of Renderer, for a request that has been checked. wait() throws the error of
    // drawing.
    uint64_t submit(const FrameRequest& request);
    FrameState wait(uint64_t ticket, FrameResult& result, std::chrono::nanoseconds most);

    // Waits until no frame is being drawn, and drops the frames in flight.
    void clear();

private:
    struct Frame {
        uint64_t ticket = 0;
        uint32_t eye_count = 0;
        EyeParams eyes[kMaxEyes] = {};
        FrameTarget targets[kMaxEyes] = {};
        FrameOptions options;
        FrameResult result;
        std::exception_ptr error{};
        enum class State { Waits, IsDrawn, Ended } state = State::Waits;
    };

    void run();
    bool drawNext(std::unique_lock<std::mutex>& lock); // draws the oldest waiting frame; returns false if there is none
    void draw(Frame& frame);

    Draw m_draw;
    Buffer<float> m_pictures[kMaxEyes]; // pictures in float, before they are converted to the target's format
    std::mutex m_mutex;                 // guards the members below
    std::condition_variable m_submitted, m_ended;
    std::deque<Frame> m_frames; // frames in flight, oldest first
    uint64_t m_last = 0;        // ticket that was given out last
    bool m_stop = false;
    std::thread m_thread; // declared last: the thread uses the members above
};

} // namespace gsc
