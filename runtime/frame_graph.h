// SPDX-License-Identifier: Apache-2.0
// A frame as a CUDA graph: captured once, then launched for every frame of the same shape with new eyes.
#pragma once

#include "runtime/frame_launch.h"

#include <memory>
#include <vector>

namespace gsc {

class FrameGraph {
public:
    // Captures the launches of `job` and the copy of the counters to `counters`. Throws Error (Device, OutOfMemory).
    FrameGraph(const FrameJob& job, FrameCounters* counters, const CudaStream& stream);
    ~FrameGraph();
    FrameGraph(const FrameGraph&) = delete;
    FrameGraph& operator=(const FrameGraph&) = delete;

    // Can it draw this job, given new eyes? Buffers are not compared: whoever moves them drops the graph.
    [[nodiscard]] bool fits(const FrameJob& job) const;

    // Asynchronous. `chosen`: the eyes as select takes them; `reuse`, `cut`, `order`: as FrameJob has them. Precondition:
    // fits() for `options`.
    void launch(const EyeParams* eyes, const EyeParams* chosen, const FrameOptions& options, const ReuseJob* reuse,
                const CutArgs* cut, const OrderJob& order, const CudaStream& stream);

    // Of the last launch, which has ended.
    [[nodiscard]] StageTimes times() const;

private:
    enum class Takes {
        Select,
        Strips,
        CutSelect,
        CutStrips,
        Slab,
        Order,
        Schedule,
        DecodeFast,
        DecodeExact,
        Keep
    }; // as part of which arguments

    struct EyeNode { // takes what every frame has anew
        cudaGraphNode_t node;
        Takes takes;
    };
    struct PassEvents {
        CudaEvent decoded, binned, sorted, blended;
    };

    void captureSelect(const FrameJob& job, const CudaStream& stream);
    void captureCut(const FrameJob& job, const CudaStream& stream);
    void capture(const FrameJob& job, FrameCounters* counters, const CudaStream& stream);
    void captureReuse(const FrameJob& job, const CudaStream& stream);
    void noteEyes(const CudaStream& stream, Takes takes);

    FrameShape m_shape;
    FrameOptions m_options;
    FrameCapacity m_capacity;
    cudaGraph_t m_graph = nullptr;
    cudaGraphExec_t m_exec = nullptr;
    std::vector<EyeNode> m_eye_nodes;
    CudaEvent m_start, m_selected;
    std::vector<std::unique_ptr<PassEvents>> m_passes;
};

} // namespace gsc
