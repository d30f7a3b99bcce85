// SPDX-License-Identifier: Apache-2.0
// The thread that draws a host renderer's frames, so that submit() does not wait for them.
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
    // Draws on the thread; if the system gives none, submit() draws. `images` and `depths` have an entry per eye;
    // images are null if the picture is not wanted.
    using Draw = std::function<void(const EyeParams* eyes, uint32_t eye_count, const FrameOptions& options,
                                    float* const* images, FrameResult& result, const DepthRows<float>* depths)>;

    explicit FrameThread(Draw draw);
    ~FrameThread(); // frames that have not begun are not drawn
    FrameThread(const FrameThread&) = delete;
    FrameThread& operator=(const FrameThread&) = delete;

    // The functions of Renderer; the request is checked already. wait() throws the error of drawing.
    uint64_t submit(const FrameRequest& request);
    FrameState wait(uint64_t ticket, FrameResult& result, std::chrono::nanoseconds most);

    // Waits until nothing is drawn, and forgets the frames in flight.
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
    bool drawNext(std::unique_lock<std::mutex>& lock); // the oldest that waits; false without one
    void draw(Frame& frame);

    Draw m_draw;
    Buffer<float> m_pictures[kMaxEyes]; // pictures of this thread that are converted to another format
    std::mutex m_mutex;                 // guards the members below
    std::condition_variable m_submitted, m_ended;
    std::deque<Frame> m_frames; // in flight, oldest first
    uint64_t m_last = 0;        // ticket
    bool m_stop = false;
    std::thread m_thread; // declared last: it uses all members above
};

} // namespace gsc
