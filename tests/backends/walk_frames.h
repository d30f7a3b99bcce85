// SPDX-License-Identifier: Apache-2.0
// Frames of a walk through the renderer interface, submitted and waited for as a caller may.
#pragma once

#include "tests/backends/reuse_scene.h"

#include <chrono>
#include <vector>

namespace gsc::test {

using Picture = std::vector<float>;

struct Frame {
    std::vector<EyeParams> eyes;
    Picture pictures[kMaxEyes];
    FrameTarget targets[kMaxEyes];
    FrameRequest request;
    uint64_t ticket = 0;
    uint32_t passes = 0, repeats = 0;
};

enum class How { OneByOne, TwoInFlight, Polled, NewestFirst };

// Frames of a walk, drawn in one of the ways a caller may choose.
inline std::vector<Frame> drawWalk(Renderer& renderer, const FrameOptions& options, size_t count, How how)
{
    std::vector<Frame> frames(count);
    const auto submit = [&](Frame& frame) { frame.ticket = renderer.submit(frame.request); };
    const auto end = [&](Frame& frame) {
        FrameResult result;
        FrameState state = FrameState::Pending;
        while (state == FrameState::Pending)
            state =
                renderer.wait(frame.ticket, result,
                              how == How::Polled ? std::chrono::nanoseconds::zero() : std::chrono::nanoseconds::max());
        frame.passes = result.passes;
        if (state == FrameState::Done)
            return;
        ++frame.repeats;
        FrameRequest again = frame.request;
        again.repeats = frame.ticket;
        frame.repeats += finish(renderer, again, renderer.submit(again)).repeats;
    };
    for (size_t i = 0; i < count; ++i) {
        Frame& frame = frames[i];
        frame.eyes = walk(int(i), 2);
        for (size_t e = 0; e < 2; ++e) {
            frame.pictures[e].assign(size_t(3) * frame.eyes[e].width * frame.eyes[e].height, -7.0f);
            frame.targets[e] = hostTarget(frame.pictures[e].data());
        }
        frame.request = {frame.eyes, frame.targets, options};
    }
    if (how == How::OneByOne) {
        for (Frame& frame : frames) {
            submit(frame);
            end(frame);
        }
    } else if (how == How::NewestFirst) {
        for (size_t i = 0; i + 1 < count; i += 2) {
            submit(frames[i]);
            submit(frames[i + 1]);
            end(frames[i + 1]);
            end(frames[i]);
        }
    } else {
        submit(frames[0]);
        for (size_t i = 1; i < count; ++i) {
            submit(frames[i]);
            end(frames[i - 1]);
        }
        end(frames[count - 1]);
    }
    return frames;
}

inline bool sameWalk(const std::vector<Frame>& a, const std::vector<Frame>& b)
{
    bool same = a.size() == b.size();
    for (size_t i = 0; same && i < a.size(); ++i)
        for (size_t e = 0; e < 2; ++e)
            same = same && sameBytes(a[i].pictures[e], b[i].pictures[e]);
    return same;
}

} // namespace gsc::test
