// SPDX-License-Identifier: Apache-2.0
// Captures the kernels of a frame into a CUDA graph, and updates their arguments for the next frame.
#pragma once

#include "kernels/frame/frame_now.h"
#include "runtime/cuda/device/cuda_device.h"

#include <memory>
#include <vector>

namespace gsc {

// A captured kernel whose arguments change with every frame.
class FrameNode {
public:
    virtual ~FrameNode() = default;
    // Sets the arguments in `exec` for the next frame. `now` has the type Args::Now, the part of the arguments that
    // changes.
    virtual void refresh(cudaGraphExec_t exec, const FrameNow& now) = 0;
};

template <typename Args>
class FrameNodeOf final : public FrameNode {
public:
    FrameNodeOf(cudaGraphNode_t node, const Args& args) : m_node(node), m_args(args)
    {
        GSC_CUDA_CHECK(cudaGraphKernelNodeGetParams(node, &m_params));
        m_params.kernelParams = m_list;
        m_params.extra = nullptr;
    }
    FrameNodeOf(const FrameNodeOf&) = delete;
    FrameNodeOf& operator=(const FrameNodeOf&) = delete;

    void refresh(cudaGraphExec_t exec, const FrameNow& now) override
    {
        setNow(m_args, static_cast<const typename Args::Now&>(now));
        GSC_CUDA_CHECK(cudaGraphExecKernelNodeSetParams(exec, m_node, &m_params));
    }

private:
    cudaGraphNode_t m_node;
    cudaKernelNodeParams m_params{};
    Args m_args;
    void* m_list[1] = {&m_args};
};

class FrameCapture {
public:
    FrameCapture(const CudaStream& stream, uint32_t processors) : m_stream(stream), m_processors(processors) {}

    [[nodiscard]] const CudaStream& stream() const { return m_stream; }
    [[nodiscard]] uint32_t processors() const { return m_processors; }

    // Adds a stage of one kernel, which takes `args` alone, by calling launch(args, stream).
    template <typename Args, typename Launch>
    void add(const Args& args, const Launch& launch)
    {
        launch(args, m_stream.handle);
        m_nodes.push_back(std::make_unique<FrameNodeOf<Args>>(last(), args));
    }
    template <typename Args>
    void add(const Args& args, void (*launch)(const Args&, uint32_t processors, CUstream_st*))
    {
        add(args, [&](const Args& a, CUstream_st* stream) { launch(a, m_processors, stream); });
    }

    void clear(void* data, size_t bytes) const { GSC_CUDA_CHECK(cudaMemsetAsync(data, 0, bytes, m_stream.handle)); }
    void copyToHost(void* host, const void* data, size_t bytes) const
    {
        GSC_CUDA_CHECK(cudaMemcpyAsync(host, data, bytes, cudaMemcpyDeviceToHost, m_stream.handle));
    }

    [[nodiscard]] std::vector<std::unique_ptr<FrameNode>> takeNodes() { return std::move(m_nodes); }

private:
    [[nodiscard]] cudaGraphNode_t last() const; // returns the node that was captured last

    const CudaStream& m_stream;
    uint32_t m_processors;
    std::vector<std::unique_ptr<FrameNode>> m_nodes;
};

} // namespace gsc
