// SPDX-License-Identifier: Apache-2.0
#include "runtime/cuda/frame/frame_graph.h"

#include "kernels/cuda/stage_clock_cuda.h"

namespace gsc {

cudaGraphNode_t FrameCapture::last() const
{
    cudaStreamCaptureStatus status{};
    const cudaGraphNode_t* nodes = nullptr;
    size_t count = 0;
#if CUDART_VERSION >= 13000
    GSC_CUDA_CHECK(cudaStreamGetCaptureInfo(m_stream.handle, &status, nullptr, nullptr, &nodes, nullptr, &count));
#else
    GSC_CUDA_CHECK(cudaStreamGetCaptureInfo(m_stream.handle, &status, nullptr, nullptr, &nodes, &count));
#endif
    return nodes[count - 1];
}

FrameGraph::FrameGraph(const FrameJob& job, const FrameReuse* reuse, FrameCounters* counters, const CudaStream& stream)
    : m_shape(job.shape), m_capacity(job.capacity)
{
    FrameCapture recorded(stream, job.limits.processors);
    GSC_CUDA_CHECK(cudaStreamBeginCapture(stream.handle, cudaStreamCaptureModeThreadLocal));
    try {
        capture(recorded, job, reuse, counters);
    } catch (...) {
        (void)cudaStreamEndCapture(stream.handle, &m_graph);
        (void)cudaGetLastError(); // clears the error of the broken capture, which the next launch would report
        if (m_graph != nullptr)
            cudaGraphDestroy(m_graph);
        throw;
    }
    m_nodes = recorded.takeNodes();
    GSC_CUDA_CHECK(cudaStreamEndCapture(stream.handle, &m_graph));
    const cudaError_t code = cudaGraphInstantiate(&m_exec, m_graph, 0);
    if (code != cudaSuccess) {
        cudaGraphDestroy(m_graph);
        throwCuda(code, "cudaGraphInstantiate(");
    }
}

FrameGraph::~FrameGraph()
{
    cudaGraphExecDestroy(m_exec);
    cudaGraphDestroy(m_graph);
}

void FrameGraph::capture(FrameCapture& capture, const FrameJob& job, const FrameReuse* reuse, FrameCounters* counters)
{
    const auto next = [&](Stage ended, Stage begun) {
        nextStageCuda(job.buffers.counters, ended, begun, capture.stream().handle);
    };
    startClockCuda(job.buffers.counters, capture.stream().handle);
    capture.clear(job.buffers.histogram, kClearedBytes);
    if (reuse != nullptr)
        reuse->prepareFrame(capture, job);
    capture.add(selectArgs(job), selectGroupsCuda);
    if (reuse != nullptr)
        reuse->listAnchors(capture, job);
    else
        capture.add(selectArgs(job), selectAnchorsCuda);
    cutDepths(capture, job);
    for (uint32_t p = 0; p < job.shape.passes; ++p) {
        next(p > 0 ? Stage::Blend : Stage::Select, Stage::Decode);
        if (p > 0)
            capture.clear(&job.buffers.counters->pass, sizeof(PassCounters));
        capture.clear(job.buffers.cells, job.shape.cells() * sizeof(uint32_t));
        listPass(capture, job, p);
        if (reuse != nullptr)
            reuse->decode(capture, job, p);
        else
            decodeFrame(capture, job, p);
        paintFrame(capture, job);
        next(Stage::Decode, Stage::Bin);
        binFrame(capture, job, p);
        next(Stage::Bin, Stage::Sort);
        sortFrame(capture, job);
        next(Stage::Sort, Stage::Blend);
        blendFrame(capture, job, p);
    }
    next(Stage::Blend, Stage::None);
    capture.copyToHost(counters, job.buffers.counters, sizeof(FrameCounters));
    if (reuse != nullptr)
        reuse->report(capture, job);
}

void FrameGraph::launch(const FrameNow& now, const CudaEvent& start, const CudaStream& stream)
{
    for (const std::unique_ptr<FrameNode>& node : m_nodes)
        node->refresh(m_exec, now);
    start.record(stream);
    GSC_CUDA_CHECK(cudaGraphLaunch(m_exec, stream.handle));
}

} // namespace gsc
