// SPDX-License-Identifier: Apache-2.0
#include "kernels/ceilings/ceilings_cuda.h"

#include "kernels/cuda/halves.cuh"
#include "kernels/cuda/launch.cuh"
#include "kernels/cuda/ptx.cuh"

namespace gsc {

namespace {

constexpr uint32_t kThreads = 256;
constexpr uint32_t kLoads = 8; // loads of 16 bytes that each thread has under way at once
static_assert(kThreads * kLoads * sizeof(uint4) == kCeilingPieceBytes);

// Each thread computes several independent chains, which hide the latency of a step; with so many steps a launch takes
// about a millisecond.
constexpr uint32_t kFmaChains = 8, kFmaSteps = 16384;
constexpr uint32_t kExpChains = 4, kExpSteps = 4096;
constexpr uint32_t kMmaChains = 8, kMmaSteps = 2048;
constexpr double kMmaFlop = 2.0 * 16 * 8 * 16; // operations that one instruction of a warp does
constexpr uint32_t kNever = 0xffffffffu;       // bits that no result has, which the compiler cannot know

__device__ __forceinline__ uint32_t scramble(uint32_t v)
{
    v = (v ^ v >> 16) * 0x7feb352du;
    v = (v ^ v >> 15) * 0x846ca68bu;
    return v ^ v >> 16;
}

__device__ __forceinline__ size_t firstWord()
{
    return size_t(blockIdx.x) * kThreads * kLoads + threadIdx.x;
}

__global__ void __launch_bounds__(kThreads) fillKernel(uint4* target)
{
#pragma unroll
    for (uint32_t i = 0; i < kLoads; ++i) {
        const size_t at = firstWord() + size_t(i) * kThreads;
        const auto v = uint32_t(at) * 4u;
        target[at] = {scramble(v), scramble(v + 1u), scramble(v + 2u), scramble(v + 3u)};
    }
}

__device__ __forceinline__ void loadPiece(const uint4* source, uint4 (&words)[kLoads])
{
#pragma unroll
    for (uint32_t i = 0; i < kLoads; ++i)
        words[i] = __ldcs(source + firstWord() + i * kThreads);
}

// Keeps the compiler from removing the operations that `result` depends on.
__device__ __forceinline__ void keep(uint32_t result, uint32_t* sink)
{
    if (result == kNever)
        *sink = result;
}

__global__ void __launch_bounds__(kThreads) copyKernel(const uint4* __restrict__ source, uint4* __restrict__ target)
{
    uint4 words[kLoads];
    loadPiece(source, words);
#pragma unroll
    for (uint32_t i = 0; i < kLoads; ++i)
        __stcs(target + firstWord() + i * kThreads, words[i]);
}

__global__ void __launch_bounds__(kThreads) readKernel(const uint4* __restrict__ source, uint32_t* sink)
{
    uint4 words[kLoads];
    loadPiece(source, words);
    uint32_t all = 0;
#pragma unroll
    for (uint32_t i = 0; i < kLoads; ++i)
        all |= words[i].x & words[i].y & words[i].z & words[i].w;
    keep(all, sink); // note: the sum is never all ones by chance: it ORs eight ANDs of four random words
}

template <uint32_t kChains, uint32_t kSteps, typename Step>
__device__ __forceinline__ void runChains(const Step& step, uint32_t* sink)
{
    float x[kChains];
#pragma unroll
    for (uint32_t c = 0; c < kChains; ++c)
        x[c] = 0.01f * float(threadIdx.x + c);
#pragma unroll 16
    for (uint32_t i = 0; i < kSteps; ++i)
#pragma unroll
        for (uint32_t c = 0; c < kChains; ++c)
            x[c] = step(x[c]);
    float sum = 0;
#pragma unroll
    for (uint32_t c = 0; c < kChains; ++c)
        sum += x[c];
    keep(__float_as_uint(sum), sink);
}

// Chains of multiply-adds whose value goes towards b / (1 - a).
__global__ void __launch_bounds__(kThreads) fmaKernel(float a, float b, uint32_t* sink)
{
    runChains<kFmaChains, kFmaSteps>([=](float x) { return fmaf(x, a, b); }, sink);
}

// Chains of exponentials whose value goes towards the x that equals 2^-x.
__global__ void __launch_bounds__(kThreads) expKernel(uint32_t* sink)
{
    runChains<kExpChains, kExpSteps>([](float x) { return exp2Approx(-x); }, sink);
}

// Two random half floats in [-1, 1).
__device__ __forceinline__ uint32_t randomHalves(uint32_t seed)
{
    const uint32_t v = scramble(seed);
    return packHalves(float(v & 0xffffu) * (1.0f / 32768) - 1.0f, float(v >> 16) * (1.0f / 32768) - 1.0f);
}

__global__ void __launch_bounds__(kThreads) mmaKernel(uint32_t* sink)
{
    uint32_t a[4];
    for (uint32_t i = 0; i < 4; ++i)
        a[i] = randomHalves(8u * threadIdx.x + i);
    const uint2 b{randomHalves(8u * threadIdx.x + 4u), randomHalves(8u * threadIdx.x + 5u)};
    float d[kMmaChains][4] = {};
#pragma unroll 4
    for (uint32_t i = 0; i < kMmaSteps; ++i)
#pragma unroll
        for (uint32_t c = 0; c < kMmaChains; ++c)
            mmaM16N8K16(d[c], a, b);
    float sum = 0;
    for (uint32_t c = 0; c < kMmaChains; ++c)
        sum += d[c][0] + d[c][1] + d[c][2] + d[c][3];
    keep(__float_as_uint(sum), sink);
}

// Launches as many blocks as the device holds at once, so that none starts later. Returns the number of threads.
template <typename... Parameters, typename... Arguments>
double launchFull(void (*kernel)(Parameters...), uint32_t processors, CUstream_st* stream,
                  const Arguments&... arguments)
{
    int blocks = 0;
    GSC_CUDA_CHECK(cudaOccupancyMaxActiveBlocksPerMultiprocessor(&blocks, kernel, int(kThreads), 0));
    launchCuda(kernel, processors * uint32_t(blocks), kThreads, 0, stream, arguments...);
    return double(processors) * blocks * kThreads;
}

uint32_t pieces(size_t bytes)
{
    return uint32_t(bytes / kCeilingPieceBytes);
}

} // namespace

void fillCuda(void* target, size_t bytes, CUstream_st* stream)
{
    launchCuda(fillKernel, pieces(bytes), kThreads, 0, stream, static_cast<uint4*>(target));
}

void copyCuda(const void* source, void* target, size_t bytes, CUstream_st* stream)
{
    launchCuda(copyKernel, pieces(bytes), kThreads, 0, stream, static_cast<const uint4*>(source),
               static_cast<uint4*>(target));
}

void readCuda(const void* source, size_t bytes, uint32_t* sink, CUstream_st* stream)
{
    launchCuda(readKernel, pieces(bytes), kThreads, 0, stream, static_cast<const uint4*>(source), sink);
}

double fmaCuda(uint32_t processors, uint32_t* sink, CUstream_st* stream)
{
    return launchFull(fmaKernel, processors, stream, 0.999f, 0.002f, sink) * kFmaChains * kFmaSteps;
}

double expCuda(uint32_t processors, uint32_t* sink, CUstream_st* stream)
{
    return launchFull(expKernel, processors, stream, sink) * kExpChains * kExpSteps;
}

double mmaCuda(uint32_t processors, uint32_t* sink, CUstream_st* stream)
{
    return launchFull(mmaKernel, processors, stream, sink) / 32 * kMmaChains * kMmaSteps * kMmaFlop;
}

} // namespace gsc
