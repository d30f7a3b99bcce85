// SPDX-License-Identifier: Apache-2.0
#include "runtime/cuda/frame_graph.h"

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

void FrameTimers::reserve(uint32_t count)
{
    while (passes.size() < count)
        passes.push_back(std::make_unique<Pass>());
}

FrameGraph::FrameGraph(const FrameJob& job, const FrameReuse& reuse, FrameCounters* counters, const FrameTimers& timers,
                       const CudaStream& stream)
    : m_shape(job.shape), m_capacity(job.capacity)
{
    FrameCapture recorded(stream, job.limits.processors);
    GSC_CUDA_CHECK(cudaStreamBeginCapture(stream.handle, cudaStreamCaptureModeThreadLocal));
    try {
        capture(recorded, job, reuse, counters, timers);
    } catch (...) {
        (void)cudaStreamEndCapture(stream.handle, &m_graph);
        (void)cudaGetLastError(); // that the capture is broken is known, and must not show up at the next launch
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

void FrameGraph::capture(FrameCapture& capture, const FrameJob& job, const FrameReuse& reuse, FrameCounters* counters,
                         const FrameTimers& timers)
{
    const bool reuses = job.shape.uses_reuse;
    capture.mark(timers.start);
    capture.clear(job.buffers.histogram, kClearedBytes);
    if (reuses)
        reuse.prepareFrame(capture, job);
    capture.add(selectArgs(job), selectGroupsCuda);
    if (reuses)
        reuse.listAnchors(capture, job);
    else
        capture.add(selectArgs(job), selectAnchorsCuda);
    cutDepths(capture, job);
    capture.mark(timers.selected);
    for (uint32_t p = 0; p < job.shape.passes; ++p) {
        if (p > 0)
            capture.clear(&job.buffers.counters->pass, sizeof(PassCounters));
        capture.clear(job.buffers.cells, job.shape.cells() * sizeof(uint32_t));
        if (reuses)
            reuse.decode(capture, job);
        else
            decodeFrame(capture, job, p);
        capture.mark(timers.passes[p]->decoded);
        binFrame(capture, job, p);
        capture.mark(timers.passes[p]->binned);
        sortFrame(capture, job);
        capture.mark(timers.passes[p]->sorted);
        blendFrame(capture, job, p);
        capture.mark(timers.passes[p]->blended);
    }
    capture.copyToHost(counters, job.buffers.counters, sizeof(FrameCounters));
    if (reuses)
        reuse.report(capture, job);
}

void FrameGraph::launch(const FrameNow& now, const CudaStream& stream)
{
    for (const std::unique_ptr<FrameNode>& node : m_nodes)
        node->refresh(m_exec, now);
    GSC_CUDA_CHECK(cudaGraphLaunch(m_exec, stream.handle));
}

StageTimes FrameTimers::times(uint32_t count, bool presented) const
{
    StageTimes times;
    times.select = selected.since(start);
    const CudaEvent* previous = &selected;
    for (uint32_t p = 0; p < count; ++p) {
        const Pass& pass = *passes[p];
        times.decode += pass.decoded.since(*previous);
        times.bin += pass.binned.since(pass.decoded);
        times.sort += pass.sorted.since(pass.binned);
        times.blend += pass.blended.since(pass.sorted);
        previous = &pass.blended;
    }
    if (presented) {
        times.blend += ready.since(*previous);
        previous = &ready;
    }
    times.total = previous->since(start);
    return times;
}

} // namespace gsc
