// SPDX-License-Identifier: Apache-2.0
#include "kernels/cuda/stage_clock_cuda.h"

#include "kernels/cuda/launch.cuh"
#include "kernels/cuda/ptx.cuh"

namespace gsc {

namespace {

struct ClockArgs {
    unsigned long long* stage_ns; // FrameCounters::stage_ns: a time for each stage
    Stage ended, begun;
};

// Adds the time to the stage that begins as a negative number and to the stage that ends as a positive one, modulo
// 2^64: a stage that has ended as often as it has begun then holds how long it took.
__global__ void clockKernel(const __grid_constant__ ClockArgs args)
{
    const unsigned long long now = deviceNanoseconds();
    atomicAdd(&args.stage_ns[uint32_t(args.ended)], now);
    atomicAdd(&args.stage_ns[uint32_t(args.begun)], 0 - now);
}

__global__ void startKernel(const __grid_constant__ ClockArgs args)
{
    const unsigned long long now = deviceNanoseconds();
    for (uint32_t i = 0; i < kStages; ++i)
        args.stage_ns[i] = i == uint32_t(args.begun) ? 0 - now : 0;
}

} // namespace

void startClockCuda(FrameCounters* counters, CUstream_st* stream)
{
    launchCuda(startKernel, 1, 1, 0, stream, ClockArgs{counters->stage_ns, Stage::Select, Stage::Select});
}

void nextStageCuda(FrameCounters* counters, Stage ended, Stage begun, CUstream_st* stream)
{
    launchCuda(clockKernel, 1, 1, 0, stream, ClockArgs{counters->stage_ns, ended, begun});
}

} // namespace gsc
