// SPDX-License-Identifier: Apache-2.0
#include "runtime/cuda/flight.h"

#include "kernels/present/present_cuda.h"

#include <algorithm>
#include <thread>

namespace gsc {

uint64_t Flight::setTargets(const FrameRequest& request)
{
    m_eye_count = uint32_t(request.eyes.size());
    std::ranges::fill(m_wanted, FrameTarget{});
    std::ranges::copy(request.targets, m_wanted);
    for (uint32_t e = 0; e < m_eye_count; ++e) {
        const uint32_t width = request.eyes[e].width;
        m_height[e] = request.eyes[e].height;
        m_columns[e] = request.options.columns.within(width);
        m_lens[e] = request.options.lens[e];
        m_wanted[e].pitch = pitchOf(m_wanted[e], width);
        m_wanted[e].depth_pitch = depthPitchOf(m_wanted[e], width);
        m_written[e] = m_wanted[e];
        if (m_wanted[e].onHost()) {
            m_written[e].kind = FrameTarget::Kind::Device;
            m_written[e].pitch = width * pixelBytes(m_wanted[e].format);
            m_written[e].depth_pitch = width * sizeof(float);
        }
    }
    ArenaLayout counted(nullptr);
    layOut(counted);
    return counted.bytes();
}

void Flight::layOut(ArenaLayout& layout)
{
    for (uint32_t e = 0; e < m_eye_count; ++e) {
        FrameTarget& to = m_written[e];
        if (m_wanted[e].onHost())
            to.pixels = layout.take<unsigned char>(m_height[e] * to.pitch);
        if (m_wanted[e].onHost() && m_wanted[e].depth != nullptr)
            to.depth = layout.take<float>(m_height[e] * to.depth_pitch / sizeof(float));
    }
}

void Flight::present(const FrameBuffers& buffers, const CudaStream& stream)
{
    PresentCudaArgs args{};
    for (uint32_t e = 0; e < m_eye_count; ++e)
        if (m_written[e].kind != FrameTarget::Kind::None)
            args.views[args.count++] = {buffers.image[e], buffers.depth[e], m_written[e], shape.width[e],
                                        m_height[e],      m_columns[e],     m_lens[e]};
    presents = args.count > 0;
    if (presents) {
        drawn.record(stream);
        presentCuda(args, stream.handle);
    }
    ready.record(stream);
}

bool Flight::passed(std::chrono::nanoseconds most) const
{
    using Clock = std::chrono::steady_clock;
    if (most == std::chrono::nanoseconds::max()) {
        GSC_CUDA_CHECK(cudaEventSynchronize(ready.handle));
        return true;
    }
    constexpr auto kLook = std::chrono::microseconds(50);
    const Clock::time_point from = Clock::now();
    while (true) {
        const cudaError_t code = cudaEventQuery(ready.handle);
        if (code == cudaSuccess)
            return true;
        if (code != cudaErrorNotReady)
            throwCuda(code, "cudaEventQuery(");
        const auto left = most - (Clock::now() - from);
        if (left <= left.zero())
            return false;
        std::this_thread::sleep_for(std::min<std::chrono::nanoseconds>(left, kLook));
    }
}

void Flight::fillResult()
{
    const FrameCounters& c = *counters.data;
    result = {};
    StageTimes& times = result.times;
    const auto of = [&c](Stage stage) { return 1e-6 * double(int64_t(c.stage_ns[uint32_t(stage)])); };
    times.select = of(Stage::Select);
    times.decode = of(Stage::Decode);
    times.bin = of(Stage::Bin);
    times.sort = of(Stage::Sort);
    times.blend = of(Stage::Blend) + (presents ? ready.since(drawn) : 0.0);
    times.total = ready.since(start);
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
        if (!to.onHost())
            continue;
        const ColumnRange& columns = m_columns[e];
        const auto copy = [&](void* into, size_t into_pitch, const void* data, size_t pitch, size_t pixel) {
            GSC_CUDA_CHECK(cudaMemcpy2DAsync(static_cast<unsigned char*>(into) + columns.first * pixel, into_pitch,
                                             static_cast<const unsigned char*>(data) + columns.first * pixel, pitch,
                                             (columns.end - columns.first) * pixel, m_height[e], cudaMemcpyDeviceToHost,
                                             stream.handle));
        };
        copy(to.pixels, to.pitch, from.pixels, from.pitch, pixelBytes(to.format));
        if (to.depth != nullptr)
            copy(to.depth, to.depth_pitch, from.depth, from.depth_pitch, sizeof(float));
        any = true;
    }
    if (any)
        GSC_CUDA_CHECK(cudaStreamSynchronize(stream.handle));
    return nullptr;
} catch (const Error&) {
    return std::current_exception();
}

} // namespace gsc
