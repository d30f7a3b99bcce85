// SPDX-License-Identifier: Apache-2.0
// Capture of a stream and what becomes of it.
#include "tests/cuda_emulation/stream.h"

using namespace gsc_emulation;

cudaError_t cudaStreamBeginCapture(cudaStream_t stream, cudaStreamCaptureMode)
{
    if (stream == nullptr || stream->captured != nullptr)
        return noted(cudaErrorIllegalState);
    stream->captured = std::make_unique<CUgraph_st>();
    stream->last = nullptr;
    countCaptures(1);
    return cudaSuccess;
}

cudaError_t cudaStreamEndCapture(cudaStream_t stream, cudaGraph_t* graph)
{
    if (stream->captured == nullptr)
        return noted(cudaErrorIllegalState);
    *graph = stream->captured.release();
    countCaptures(-1);
    return cudaSuccess;
}

cudaError_t cudaStreamGetCaptureInfo(cudaStream_t stream, cudaStreamCaptureStatus* status, unsigned long long* id,
                                     cudaGraph_t* graph, const cudaGraphNode_t** nodes, const cudaGraphEdgeData** edges,
                                     size_t* count)
{
    *status = stream->captured != nullptr ? cudaStreamCaptureStatusActive : cudaStreamCaptureStatusNone;
    if (stream->captured == nullptr)
        return cudaSuccess;
    if (id != nullptr)
        *id = 1;
    if (graph != nullptr)
        *graph = stream->captured.get();
    if (edges != nullptr)
        *edges = nullptr;
    *nodes = &stream->last;
    *count = stream->last != nullptr ? 1 : 0;
    return cudaSuccess;
}

cudaError_t cudaGraphDestroy(cudaGraph_t graph)
{
    delete graph;
    return cudaSuccess;
}

cudaError_t cudaGraphKernelNodeGetParams(cudaGraphNode_t node, cudaKernelNodeParams* params)
{
    if (node->call == nullptr)
        return noted(cudaErrorInvalidValue);
    KernelCall& call = *node->call;
    *params = {const_cast<void*>(call.function()), call.grid(),      call.block(),
               unsigned(call.sharedBytes()),       call.arguments(), nullptr};
    return cudaSuccess;
}

cudaError_t cudaGraphInstantiate(cudaGraphExec_t* exec, cudaGraph_t graph, unsigned long long)
{
    *exec = new CUgraphExec_st{graph, {}};
    for (const auto& node : graph->nodes)
        (*exec)->nodes.push_back(*node);
    return cudaSuccess;
}

cudaError_t cudaGraphExecKernelNodeSetParams(cudaGraphExec_t exec, cudaGraphNode_t node,
                                             const cudaKernelNodeParams* params)
{
    for (size_t i = 0; i < exec->nodes.size(); ++i)
        if (exec->graph->nodes[i].get() == node && node->call != nullptr && params->func == node->call->function() &&
            params->extra == nullptr) {
            exec->nodes[i].call = node->call->with(*params);
            return cudaSuccess;
        }
    return noted(cudaErrorInvalidValue);
}

cudaError_t cudaGraphLaunch(cudaGraphExec_t exec, cudaStream_t stream)
{
    if (stream != nullptr && stream->captured != nullptr)
        return noted(cudaErrorStreamCaptureUnsupported);
    for (const CUgraphNode_st& node : exec->nodes)
        if (const cudaError_t code = runNode(node); code != cudaSuccess)
            return noted(code);
    return cudaSuccess;
}

cudaError_t cudaGraphExecDestroy(cudaGraphExec_t exec)
{
    delete exec;
    return cudaSuccess;
}
