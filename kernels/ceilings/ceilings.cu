// SPDX-License-Identifier: Apache-2.0
#include "kernels/ceilings/ceilings_cuda.h"

#include "kernels/cuda/cuda_check.h"

#include <cuda_fp16.h>

namespace gsc {

namespace {

constexpr uint32_t kThreads = 256;
constexpr uint32_t kLoads = 8; // of 16 bytes, in flight per thread
static_assert(kThreads * kLoads * sizeof(uint4) == kCeilingPieceBytes);

// Independent chains per thread hide the latency of a step; the steps make a launch about a millisecond long.
constexpr uint32_t kFmaChains = 8, kFmaSteps = 16384;
constexpr uint32_t kExpChains = 4, kExpSteps = 4096;
constexpr uint32_t kMmaChains = 8, kMmaSteps = 2048;
constexpr double kMmaFlop = 2.0 * 16 * 8 * 16; // of one instruction, that is of a warp
constexpr uint32_t kNever = 0xffffffffu;       // no result has these bits, but the compiler cannot know

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

__global__ void __launch_bounds__(kThreads) copyKernel(const uint4* __restrict__ source, uint4* __restrict__ target)
{
    uint4 words[kLoads];
#pragma unroll
    for (uint32_t i = 0; i < kLoads; ++i)
        words[i] = __ldcs(source + firstWord() + i * kThreads);
#pragma unroll
    for (uint32_t i = 0; i < kLoads; ++i)
        __stcs(target + firstWord() + i * kThreads, words[i]);
}

__global__ void __launch_bounds__(kThreads) readKernel(const uint4* __restrict__ source, uint32_t* sink)
{
    uint4 words[kLoads];
#pragma unroll
    for (uint32_t i = 0; i < kLoads; ++i)
        words[i] = __ldcs(source + firstWord() + i * kThreads);
    uint32_t all = 0;
#pragma unroll
    for (uint32_t i = 0; i < kLoads; ++i)
        all |= words[i].x & words[i].y & words[i].z & words[i].w;
    // note: `all` is eight ANDs of four random words, ORed: all ones has no chance
    if (all == kNever)
        *sink = all;
}

// Goes towards b / (1 - a).
__global__ void __launch_bounds__(kThreads) fmaKernel(float a, float b, uint32_t* sink)
{
    float x[kFmaChains];
#pragma unroll
    for (uint32_t c = 0; c < kFmaChains; ++c)
        x[c] = 0.01f * float(threadIdx.x + c);
#pragma unroll 16
    for (uint32_t i = 0; i < kFmaSteps; ++i)
#pragma unroll
        for (uint32_t c = 0; c < kFmaChains; ++c)
            x[c] = fmaf(x[c], a, b);
    float sum = 0;
#pragma unroll
    for (uint32_t c = 0; c < kFmaChains; ++c)
        sum += x[c];
    if (__float_as_uint(sum) == kNever)
        *sink = kNever;
}

// Goes towards the x that is 2^-x.
__global__ void __launch_bounds__(kThreads) expKernel(uint32_t* sink)
{
    float x[kExpChains];
#pragma unroll
    for (uint32_t c = 0; c < kExpChains; ++c)
        x[c] = 0.01f * float(threadIdx.x + c);
#pragma unroll 16
    for (uint32_t i = 0; i < kExpSteps; ++i)
#pragma unroll
        for (uint32_t c = 0; c < kExpChains; ++c)
            asm("ex2.approx.ftz.f32 %0, %1;" : "=f"(x[c]) : "f"(-x[c]));
    float sum = 0;
#pragma unroll
    for (uint32_t c = 0; c < kExpChains; ++c)
        sum += x[c];
    if (__float_as_uint(sum) == kNever)
        *sink = kNever;
}

// Two halves in [-1, 1).
__device__ __forceinline__ uint32_t randomHalves(uint32_t seed)
{
    const uint32_t v = scramble(seed);
    const __half2 h =
        __floats2half2_rn(float(v & 0xffffu) * (1.0f / 32768) - 1.0f, float(v >> 16) * (1.0f / 32768) - 1.0f);
    return reinterpret_cast<const uint32_t&>(h);
}

__global__ void __launch_bounds__(kThreads) mmaKernel(uint32_t* sink)
{
    uint32_t a[4], b[2];
    for (uint32_t i = 0; i < 4; ++i)
        a[i] = randomHalves(8u * threadIdx.x + i);
    for (uint32_t i = 0; i < 2; ++i)
        b[i] = randomHalves(8u * threadIdx.x + 4u + i);
    float d[kMmaChains][4] = {};
#pragma unroll 4
    for (uint32_t i = 0; i < kMmaSteps; ++i)
#pragma unroll
        for (uint32_t c = 0; c < kMmaChains; ++c)
            asm volatile("mma.sync.aligned.m16n8k16.row.col.f32.f16.f16.f32 {%0,%1,%2,%3}, {%4,%5,%6,%7}, {%8,%9}, "
                         "{%0,%1,%2,%3};"
                         : "+f"(d[c][0]), "+f"(d[c][1]), "+f"(d[c][2]), "+f"(d[c][3])
                         : "r"(a[0]), "r"(a[1]), "r"(a[2]), "r"(a[3]), "r"(b[0]), "r"(b[1]));
    float sum = 0;
    for (uint32_t c = 0; c < kMmaChains; ++c)
        sum += d[c][0] + d[c][1] + d[c][2] + d[c][3];
    if (__float_as_uint(sum) == kNever)
        *sink = kNever;
}

// As many blocks as the device holds at once, so that no last wave is half empty.
template <typename Kernel>
uint32_t fullGrid(Kernel* kernel, uint32_t processors)
{
    int blocks = 0;
    GSC_CUDA_CHECK(cudaOccupancyMaxActiveBlocksPerMultiprocessor(&blocks, kernel, int(kThreads), 0));
    return processors * uint32_t(blocks);
}

uint32_t pieces(size_t bytes)
{
    return uint32_t(bytes / kCeilingPieceBytes);
}

} // namespace

void fillCuda(void* target, size_t bytes, CUstream_st* stream)
{
    fillKernel<<<pieces(bytes), kThreads, 0, stream>>>(static_cast<uint4*>(target));
    GSC_CUDA_CHECK(cudaGetLastError());
}

void copyCuda(const void* source, void* target, size_t bytes, CUstream_st* stream)
{
    copyKernel<<<pieces(bytes), kThreads, 0, stream>>>(static_cast<const uint4*>(source), static_cast<uint4*>(target));
    GSC_CUDA_CHECK(cudaGetLastError());
}

void readCuda(const void* source, size_t bytes, uint32_t* sink, CUstream_st* stream)
{
    readKernel<<<pieces(bytes), kThreads, 0, stream>>>(static_cast<const uint4*>(source), sink);
    GSC_CUDA_CHECK(cudaGetLastError());
}

double fmaCuda(uint32_t processors, uint32_t* sink, CUstream_st* stream)
{
    const uint32_t blocks = fullGrid(fmaKernel, processors);
    fmaKernel<<<blocks, kThreads, 0, stream>>>(0.999f, 0.002f, sink);
    GSC_CUDA_CHECK(cudaGetLastError());
    return double(blocks) * kThreads * kFmaChains * kFmaSteps;
}

double expCuda(uint32_t processors, uint32_t* sink, CUstream_st* stream)
{
    const uint32_t blocks = fullGrid(expKernel, processors);
    expKernel<<<blocks, kThreads, 0, stream>>>(sink);
    GSC_CUDA_CHECK(cudaGetLastError());
    return double(blocks) * kThreads * kExpChains * kExpSteps;
}

double mmaCuda(uint32_t processors, uint32_t* sink, CUstream_st* stream)
{
    const uint32_t blocks = fullGrid(mmaKernel, processors);
    mmaKernel<<<blocks, kThreads, 0, stream>>>(sink);
    GSC_CUDA_CHECK(cudaGetLastError());
    return double(blocks) * (kThreads / 32) * kMmaChains * kMmaSteps * kMmaFlop;
}

} // namespace gsc
