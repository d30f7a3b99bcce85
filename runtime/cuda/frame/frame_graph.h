// SPDX-License-Identifier: Apache-2.0
// A frame as a CUDA graph, which is captured once and then launched for every frame of the same shape.
#pragma once

#include "runtime/cuda/frame/frame_stages.h"

#include <memory>
#include <vector>

namespace gsc {

class FrameGraph {
public:
    // Captures the stages of `job` and the copy of the frame's counters to `counters`. `reuse` replaces some stages;
    // null = none. Throws Error (Device, OutOfMemory).
    FrameGraph(const FrameJob& job, const FrameReuse* reuse, FrameCounters* counters, const CudaStream& stream);
    ~FrameGraph();
    FrameGraph(const FrameGraph&) = delete;
    FrameGraph& operator=(const FrameGraph&) = delete;

    // Returns true if the graph can draw this job. Addresses of buffers are not compared: code that moves buffers
    // drops the graphs.
    [[nodiscard]] bool fits(const FrameJob& job) const { return m_shape == job.shape && m_capacity == job.capacity; }

    // Enqueues the frame behind `start`. `now` is the argument of FrameReuse, if the graph has one.
    void launch(const FrameNow& now, const CudaEvent& start, const CudaStream& stream);

private:
    void capture(FrameCapture& capture, const FrameJob& job, const FrameReuse* reuse, FrameCounters* counters);

    FrameShape m_shape;
    FrameCapacity m_capacity;
    cudaGraph_t m_graph = nullptr;
    cudaGraphExec_t m_exec = nullptr;
    std::vector<std::unique_ptr<FrameNode>> m_nodes;
};

} // namespace gsc
