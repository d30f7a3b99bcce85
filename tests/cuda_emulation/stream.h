// SPDX-License-Identifier: Apache-2.0
// Parts that both halves of the emulated runtime use: work on a stream is done at once, or becomes a node of a graph.
#pragma once

#include "tests/cuda_emulation/kernel_call.h"

#include <chrono>
#include <functional>
#include <memory>
#include <vector>

struct CUgraphNode_st {
    std::shared_ptr<gsc_emulation::KernelCall> call; // null: `work`
    std::function<cudaError_t()> work;
};

struct CUgraph_st {
    std::vector<std::unique_ptr<CUgraphNode_st>> nodes; // in the order of the capture
};

struct CUgraphExec_st {
    const CUgraph_st* graph;
    std::vector<CUgraphNode_st> nodes; // kernels with arguments of their own
};

struct CUstream_st {
    std::unique_ptr<CUgraph_st> captured; // while it captures
    cudaGraphNode_t last = nullptr;
};

struct CUevent_st {
    bool recorded = false;
    std::chrono::steady_clock::time_point at;
};

namespace gsc_emulation {

cudaError_t noted(cudaError_t code); // for cudaGetLastError
bool capturing();                    // any stream of this thread
void countCaptures(int change);

cudaError_t runNode(const CUgraphNode_st& node);
cudaError_t enqueue(cudaStream_t stream, CUgraphNode_st node);

} // namespace gsc_emulation
