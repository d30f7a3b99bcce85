// SPDX-License-Identifier: Apache-2.0
// Code that only nvcc compiles: instructions that CUDA C++ has no name for, and dynamic shared memory. Where CUDA is emulated,
// a header of the same path comes before this one (tests/cuda_emulation/include).
#pragma once

#include <cstdint>

// A kernel's dynamic shared memory. A function that returns it costs the sort 8 instructions.
#define GSC_DYNAMIC_SHARED(name) extern __shared__ __align__(16) unsigned char name[]

namespace gsc {

// d += a b: 16 x 16 halves times 16 x 8, accumulated in fp32, over the fragments of a warp (mma.m16n8k16).
__device__ __forceinline__ void mmaM16N8K16(float* d, const uint32_t* a, uint2 b)
{
    asm volatile("mma.sync.aligned.m16n8k16.row.col.f32.f16.f16.f32 {%0,%1,%2,%3}, {%4,%5,%6,%7}, {%8,%9}, "
                 "{%0,%1,%2,%3};"
                 : "+f"(d[0]), "+f"(d[1]), "+f"(d[2]), "+f"(d[3])
                 : "r"(a[0]), "r"(a[1]), "r"(a[2]), "r"(a[3]), "r"(b.x), "r"(b.y));
}

// max(v, 0) of both as halves, `low` in the low bits. Saturates, because an infinity would make every product it meets
// infinite or NaN; NaN stays.
__device__ __forceinline__ uint32_t halvesRelu(float low, float high)
{
    uint32_t packed;
    asm("cvt.rn.relu.satfinite.f16x2.f32 %0, %1, %2;" : "=r"(packed) : "f"(high), "f"(low));
    return packed;
}

// 2^v to 2 ulp; subnormal results are zero.
__device__ __forceinline__ float exp2Approx(float v)
{
    float e;
    asm("ex2.approx.ftz.f32 %0, %1;" : "=f"(e) : "f"(v));
    return e;
}

// To 1 ulp or so; of subnormal numbers zero.
__device__ __forceinline__ float sqrtApprox(float v)
{
    float root;
    asm("sqrt.approx.ftz.f32 %0, %1;" : "=f"(root) : "f"(v));
    return root;
}

// sum += weight * color, of three, where light >= least. Predicates: a branch or selects in their place take longer.
__device__ __forceinline__ void addColorWhere(float light, float least, float weight, const float* color, float* sum)
{
    asm("{\n\t.reg .pred p;\n\tsetp.ge.ftz.f32 p, %3, %4;\n\t@p fma.rn.ftz.f32 %0, %5, %6, %0;\n\t"
        "@p fma.rn.ftz.f32 %1, %5, %7, %1;\n\t@p fma.rn.ftz.f32 %2, %5, %8, %2;\n\t}"
        : "+f"(sum[0]), "+f"(sum[1]), "+f"(sum[2])
        : "f"(light), "f"(least), "f"(weight), "f"(color[0]), "f"(color[1]), "f"(color[2]));
}

// Waits for `threads` threads of the block at barrier `id`; shared memory written before is seen after.
__device__ __forceinline__ void barrierSync(uint32_t id, uint32_t threads)
{
    asm volatile("bar.sync %0, %1;" : : "r"(id), "r"(threads) : "memory");
}

// Waits as barrierSync() does; true if `value` is true in any of the threads.
__device__ __forceinline__ bool barrierAny(uint32_t id, uint32_t threads, bool value)
{
    uint32_t result;
    asm volatile("{\n\t.reg .pred p, q;\n\tsetp.ne.u32 q, %1, 0;\n\tbar.red.or.pred p, %2, %3, q;\n\t"
                 "selp.u32 %0, 1, 0, p;\n\t}"
                 : "=r"(result)
                 : "r"(uint32_t(value)), "r"(id), "r"(threads)
                 : "memory");
    return result != 0;
}

// Asks for the bytes at `address` in global memory, so that the second cache has them when they are read.
__device__ __forceinline__ void prefetchGlobal(const void* address)
{
    asm volatile("prefetch.global.L2 [%0];" : : "l"(address));
}

// Keeps the compiler from computing a value anew where it is used, which it does to save a register.
__device__ __forceinline__ void keepComputed(uint32_t& value)
{
    asm volatile("" : "+r"(value));
}

// Lets the kernel launched beside this one start (launchCudaAs()), once all blocks have said so or ended.
__device__ __forceinline__ void launchDependents()
{
#if __CUDA_ARCH__ >= 900
    asm volatile("griddepcontrol.launch_dependents;");
#endif
}

// Waits until the kernel that this one was launched beside has ended; its writes are visible afterwards.
__device__ __forceinline__ void waitForEarlier()
{
#if __CUDA_ARCH__ >= 900
    asm volatile("griddepcontrol.wait;" : : : "memory");
#endif
}

// Reads now: the compiler delays a plain read until it is known whether the value is needed.
__device__ __forceinline__ uint32_t loadNow(const uint32_t* at)
{
    uint32_t value;
    asm volatile("ld.relaxed.gpu.global.u32 %0, [%1];" : "=r"(value) : "l"(at));
    return value;
}

// Reads a counter of another block; that block's writes before the count are visible afterwards.
__device__ __forceinline__ uint32_t loadAcquire(const uint32_t* at)
{
    uint32_t value;
    asm volatile("ld.acquire.gpu.global.u32 %0, [%1];" : "=r"(value) : "l"(at) : "memory");
    return value;
}

// Time in nanoseconds, by a clock that all multiprocessors have in common; on an H200 in steps of 32.
__device__ __forceinline__ unsigned long long deviceNanoseconds()
{
    unsigned long long now;
    asm volatile("mov.u64 %0, %globaltimer;" : "=l"(now));
    return now;
}

} // namespace gsc
