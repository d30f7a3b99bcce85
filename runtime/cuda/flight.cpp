// SPDX-License-Identifier: Apache-2.0
#include "runtime/cuda/flight.h"

#include "kernels/present/present_cuda.h"

#include <algorithm>
#include <thread>

namespace gsc {

namespace {

bool isHost(const FrameTarget& target)
{
    return target.kind == FrameTarget::Kind::Host;
}

} // namespace

uint64_t Flight::setTargets(const FrameRequest& request)
{
    m_eye_count = uint32_t(request.eyes.size());
    std::ranges::fill(m_wanted, FrameTarget{});
    std::ranges::copy(request.targets, m_wanted);
    for (uint32_t e = 0; e < m_eye_count; ++e) {
        const uint32_t width = request.eyes[e].width;
        m_height[e] = request.eyes[e].height;
        m_wanted[e].pitch = pitchOf(m_wanted[e], width);
        m_wanted[e].depth_pitch = depthPitchOf(m_wanted[e], width);
        m_written[e] = m_wanted[e];
        if (isHost(m_wanted[e])) {
            m_written[e].kind = FrameTarget::Kind::Device;
            m_written[e].pitch = width * pixelBytes(m_wanted[e].format);
            m_written[e].depth_pitch = width * sizeof(float);
        }
    }
    ArenaLayout counted(nullptr);
    layOut(counted);
    return counted.bytes();
}

void Flight::placePictures()
{
    layOutIn(m_pictures, "the pictures", [this](ArenaLayout& layout) { layOut(layout); });
}

void Flight::layOut(ArenaLayout& layout)
{
    for (uint32_t e = 0; e < m_eye_count; ++e) {
        FrameTarget& to = m_written[e];
        if (isHost(m_wanted[e]))
            to.pixels = layout.take<unsigned char>(m_height[e] * to.pitch);
        if (isHost(m_wanted[e]) && m_wanted[e].depth != nullptr)
            to.depth = layout.take<float>(m_height[e] * to.depth_pitch / sizeof(float));
    }
}

bool Flight::presents() const
{
    return std::ranges::any_of(m_wanted, [](const FrameTarget& t) { return t.kind != FrameTarget::Kind::None; });
}

void Flight::present(const FrameBuffers& buffers, const CudaStream& stream) const
{
    for (uint32_t e = 0; e < m_eye_count; ++e)
        if (m_written[e].kind != FrameTarget::Kind::None)
            presentCuda({buffers.image[e], buffers.depth[e], m_written[e], shape.width[e], shape.height[e]},
                        stream.handle);
    timers.ready.record(stream);
}

bool Flight::passed(std::chrono::nanoseconds most) const
{
    using Clock = std::chrono::steady_clock;
    if (most == std::chrono::nanoseconds::max()) {
        GSC_CUDA_CHECK(cudaEventSynchronize(timers.ready.handle));
        return true;
    }
    constexpr auto kLook = std::chrono::microseconds(50);
    const Clock::time_point start = Clock::now();
    while (true) {
        const cudaError_t code = cudaEventQuery(timers.ready.handle);
        if (code == cudaSuccess)
            return true;
        if (code != cudaErrorNotReady)
            throwCuda(code, "cudaEventQuery(");
        const auto left = most - (Clock::now() - start);
        if (left <= left.zero())
            return false;
        std::this_thread::sleep_for(std::min<std::chrono::nanoseconds>(left, kLook));
    }
}

void Flight::fillCounts()
{
    const FrameCounters& c = *counters.data;
    for (uint32_t e = 0; e < shape.eye_count; ++e) {
        EyeCounts& eye = result.eyes[e];
        eye.groups_tested = c.groups_tested[e];
        eye.anchors_tested = c.anchors_tested[e];
        eye.anchors_visible = c.anchors_visible[e];
        eye.anchors_decoded = !shape.merged ? c.anchors_visible[e] : e == 0 ? c.anchors_listed : 0;
        eye.gaussians_alive = c.gaussians[e];
        eye.gaussians_visible = c.splats[e];
        eye.gaussians_dropped = c.dropped[e];
        eye.pairs = c.pairs[e];
        eye.blend_evaluations = c.evaluations[e];
    }
}

std::exception_ptr Flight::copyToHost(const CudaStream& stream) const
try {
    bool any = false;
    for (uint32_t e = 0; e < m_eye_count; ++e) {
        const FrameTarget &to = m_wanted[e], &from = m_written[e];
        if (!isHost(to))
            continue;
        GSC_CUDA_CHECK(cudaMemcpy2DAsync(to.pixels, to.pitch, from.pixels, from.pitch, from.pitch, m_height[e],
                                         cudaMemcpyDeviceToHost, stream.handle));
        if (to.depth != nullptr)
            GSC_CUDA_CHECK(cudaMemcpy2DAsync(to.depth, to.depth_pitch, from.depth, from.depth_pitch, from.depth_pitch,
                                             m_height[e], cudaMemcpyDeviceToHost, stream.handle));
        any = true;
    }
    if (any)
        GSC_CUDA_CHECK(cudaStreamSynchronize(stream.handle));
    return nullptr;
} catch (const Error&) {
    return std::current_exception();
}

} // namespace gsc
