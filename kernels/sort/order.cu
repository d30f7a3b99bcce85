// SPDX-License-Identifier: Apache-2.0
#include "kernels/sort/order_cuda.h"

#include "kernels/common/depth_cells.cuh"
#include "kernels/common/launch.cuh"

namespace gsc {

namespace {

constexpr uint32_t kThreads = 128;

__global__ void __launch_bounds__(kThreads) orderKernel(const __grid_constant__ OrderCudaArgs args)
{
    if (willRepeat(*args.counters))
        return;
    unsigned long long keys = 0;
    for (uint32_t l = 0; l < args.lists; ++l)
        keys += args.counters->pass.pairs[l];
    const auto step = uint32_t((keys + kOrderSamples - 1) / kOrderSamples);
    const unsigned long long at = (unsigned long long)(blockIdx.x * kThreads + threadIdx.x) * step;
    if (at < keys)
        atomicAdd(args.next + depthBucket(args.places[args.keys[at].slot].depth_bits), 1u);
}

} // namespace

void noteOrderCuda(const OrderCudaArgs& args, CUstream_st* stream)
{
    launchCuda(orderKernel, kOrderSamples / kThreads, kThreads, 0, stream, args);
}

} // namespace gsc
