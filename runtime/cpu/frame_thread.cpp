// SPDX-License-Identifier: Apache-2.0
#include "runtime/cpu/frame_thread.h"

#include "format/machine/threads.h"
#include "kernels/present/pixel.h"
#include "runtime/backend/frame_checks.h"

#include <algorithm>
#include <system_error>

namespace gsc {

namespace {

// Returns true if the picture can be drawn directly into the memory of the target.
bool isPlain(const FrameTarget& target, const EyeParams& eye)
{
    return target.format == PixelFormat::Rgb32f && pitchOf(target, eye.width) == eye.width * size_t(12);
}

void store(const FrameTarget& target, const EyeParams& eye, const ColumnRange& drawn, const float* image)
{
    auto* const rows = static_cast<unsigned char*>(target.pixels);
    for (uint32_t y = 0; y < eye.height; ++y) {
        const float* const from = image + size_t(y) * eye.width * 3;
        void* const row = rows + y * pitchOf(target, eye.width);
        for (uint32_t x = drawn.first; x < drawn.end; ++x)
            switch (target.format) {
            case PixelFormat::Rgb32f:
                std::copy_n(from + 3 * x, 3, static_cast<float*>(row) + 3 * x);
                break;
            case PixelFormat::Rgba16f:
                static_cast<PixelHalves*>(row)[x] = pixelHalvesOf(from + 3 * x);
                break;
            case PixelFormat::Rgba8:
                static_cast<PixelBytes*>(row)[x] = pixelBytesOf(from + 3 * x);
                break;
            case PixelFormat::Bgra8:
                static_cast<PixelBytesBlueFirst*>(row)[x] = pixelBytesBlueFirstOf(from + 3 * x);
                break;
            }
    }
}

} // namespace

FrameThread::FrameThread(Draw draw) : m_draw(std::move(draw))
{
    const ThreadAttempt attempt;
    try {
        m_thread = std::thread([this] { run(); });
    } catch (const std::system_error&) {
        // no thread could be started, so submit() draws
    }
}

FrameThread::~FrameThread()
{
    {
        const std::lock_guard lock(m_mutex);
        m_stop = true;
    }
    m_submitted.notify_all();
    if (m_thread.joinable())
        m_thread.join();
}

uint64_t FrameThread::submit(const FrameRequest& request)
{
    std::unique_lock lock(m_mutex);
    checkInFlight(m_frames.size());
    Frame& frame = m_frames.emplace_back();
    frame.ticket = ++m_last;
    frame.eye_count = uint32_t(request.eyes.size());
    std::ranges::copy(request.eyes, frame.eyes);
    std::ranges::copy(request.targets, frame.targets);
    frame.options = request.options;
    if (!m_thread.joinable())
        drawNext(lock);
    lock.unlock();
    m_submitted.notify_one();
    return m_last;
}

FrameState FrameThread::wait(uint64_t ticket, FrameResult& result, std::chrono::nanoseconds most)
{
    std::unique_lock lock(m_mutex);
    const auto frame = std::ranges::find(m_frames, ticket, &Frame::ticket);
    if (frame == m_frames.end())
        throwNotInFlight(ticket);
    const auto ended = [&] { return frame->state == Frame::State::Ended; };
    if (most == std::chrono::nanoseconds::max())
        m_ended.wait(lock, ended);
    else if (!m_ended.wait_for(lock, most, ended))
        return FrameState::Pending;
    const std::exception_ptr error = frame->error;
    result = frame->result;
    m_frames.erase(frame);
    if (error)
        std::rethrow_exception(error);
    return FrameState::Done;
}

void FrameThread::clear()
{
    std::unique_lock lock(m_mutex);
    std::erase_if(m_frames, [](const Frame& frame) { return frame.state == Frame::State::Waits; });
    m_ended.wait(lock, [&] {
        return std::ranges::all_of(m_frames, [](const Frame& frame) { return frame.state == Frame::State::Ended; });
    });
    m_frames.clear();
}

void FrameThread::run()
{
    std::unique_lock lock(m_mutex);
    while (!m_stop)
        if (!drawNext(lock))
            m_submitted.wait(lock);
}

bool FrameThread::drawNext(std::unique_lock<std::mutex>& lock)
{
    const auto next = std::ranges::find(m_frames, Frame::State::Waits, &Frame::state);
    if (next == m_frames.end())
        return false;
    Frame frame = *next; // a copy, because the deque may move its elements meanwhile
    next->state = Frame::State::IsDrawn;
    lock.unlock();
    draw(frame);
    lock.lock();
    const auto drawn = std::ranges::find(m_frames, frame.ticket, &Frame::ticket);
    drawn->result = frame.result;
    drawn->error = frame.error;
    drawn->state = Frame::State::Ended;
    m_ended.notify_all();
    return true;
}

void FrameThread::draw(Frame& frame)
{
    float* images[kMaxEyes] = {};
    DepthRows<float> depths[kMaxEyes];
    try {
        for (uint32_t e = 0; e < frame.eye_count; ++e) {
            const FrameTarget& target = frame.targets[e];
            if (target.kind == FrameTarget::Kind::None)
                continue;
            depths[e] = {target.depth, depthPitchOf(target, frame.eyes[e].width) / sizeof(float)};
            if (isPlain(target, frame.eyes[e])) {
                images[e] = static_cast<float*>(target.pixels);
            } else {
                m_pictures[e].reserve(size_t(frame.eyes[e].width) * frame.eyes[e].height * 3);
                images[e] = m_pictures[e].data();
            }
        }
        m_draw(frame.eyes, frame.eye_count, frame.options, images, frame.result, depths);
        for (uint32_t e = 0; e < frame.eye_count; ++e)
            if (images[e] != nullptr && !isPlain(frame.targets[e], frame.eyes[e]))
                store(frame.targets[e], frame.eyes[e], frame.options.columns.within(frame.eyes[e].width), images[e]);
    } catch (...) {
        frame.error = std::current_exception();
    }
}

} // namespace gsc
