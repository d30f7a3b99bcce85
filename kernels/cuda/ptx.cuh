// SPDX-License-Identifier: Apache-2.0
// Instructions that CUDA C++ has no name for, and dynamic shared memory: code that only nvcc compiles. Where CUDA is
// emulated, a header of equal path takes its place (tests/cuda_emulation/include).
#pragma once

#include <cstdint>

// Declares the dynamic shared memory of a kernel. It is a macro because a function that returns the memory costs the
// sort 8 instructions.
#define GSC_DYNAMIC_SHARED(name) extern __shared__ __align__(16) unsigned char name[]

namespace gsc {

// Computes d += a b with a of 16 x 16 halves, b of 16 x 8 halves and sums in fp32; the matrices are spread over the
// lanes of a warp as fragments (mma.m16n8k16).
__device__ __forceinline__ void mmaM16N8K16(float* d, const uint32_t* a, uint2 b)
{
    asm volatile("mma.sync.aligned.m16n8k16.row.col.f32.f16.f16.f32 {%0,%1,%2,%3}, {%4,%5,%6,%7}, {%8,%9}, "
                 "{%0,%1,%2,%3};"
                 : "+f"(d[0]), "+f"(d[1]), "+f"(d[2]), "+f"(d[3])
                 : "r"(a[0]), "r"(a[1]), "r"(a[2]), "r"(a[3]), "r"(b.x), "r"(b.y));
}

// max(v, 0) of two values, as half floats; that of `low` is in the low bits. Values beyond a half become the largest
// one, since an infinity would make products infinite or NaN; NaN stays NaN.
__device__ __forceinline__ uint32_t halvesRelu(float low, float high)
{
    uint32_t packed;
    asm("cvt.rn.relu.satfinite.f16x2.f32 %0, %1, %2;" : "=r"(packed) : "f"(high), "f"(low));
    return packed;
}

// 2^v with an error of up to 2 ulp; results that would be subnormal are zero.
__device__ __forceinline__ float exp2Approx(float v)
{
    float e;
    asm("ex2.approx.ftz.f32 %0, %1;" : "=f"(e) : "f"(v));
    return e;
}

// Square root with an error of about 1 ulp; zero for subnormal numbers.
__device__ __forceinline__ float sqrtApprox(float v)
{
    float root;
    asm("sqrt.approx.ftz.f32 %0, %1;" : "=f"(root) : "f"(v));
    return root;
}

// Adds weight * color, three values, to `sum` if light >= least. Uses predicates: a branch or selects take longer.
__device__ __forceinline__ void addColorWhere(float light, float least, float weight, const float* color, float* sum)
{
    asm("{\n\t.reg .pred p;\n\tsetp.ge.ftz.f32 p, %3, %4;\n\t@p fma.rn.ftz.f32 %0, %5, %6, %0;\n\t"
        "@p fma.rn.ftz.f32 %1, %5, %7, %1;\n\t@p fma.rn.ftz.f32 %2, %5, %8, %2;\n\t}"
        : "+f"(sum[0]), "+f"(sum[1]), "+f"(sum[2])
        : "f"(light), "f"(least), "f"(weight), "f"(color[0]), "f"(color[1]), "f"(color[2]));
}

// Waits until `threads` threads of the block are at barrier `id`; what they wrote to shared memory is then visible.
__device__ __forceinline__ void barrierSync(uint32_t id, uint32_t threads)
{
    asm volatile("bar.sync %0, %1;" : : "r"(id), "r"(threads) : "memory");
}

// Waits as barrierSync() does; returns true if `value` is true in any of the threads.
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

// Prefetches the bytes at `address` in global memory into the second-level cache.
__device__ __forceinline__ void prefetchGlobal(const void* address)
{
    asm volatile("prefetch.global.L2 [%0];" : : "l"(address));
}

// Keeps the compiler from computing `value` again where it is used, which it would do to save a register.
__device__ __forceinline__ void keepComputed(uint32_t& value)
{
    asm volatile("" : "+r"(value));
}

// Lets the kernel that was launched beside this one (launchCudaAs()) start as soon as all blocks of this kernel have
// called launchDependents() or ended.
__device__ __forceinline__ void launchDependents()
{
#if __CUDA_ARCH__ >= 900
    asm volatile("griddepcontrol.launch_dependents;");
#endif
}

// Waits until the kernel beside which this one was launched has ended; all that it wrote is then visible.
__device__ __forceinline__ void waitForEarlier()
{
#if __CUDA_ARCH__ >= 900
    asm volatile("griddepcontrol.wait;" : : : "memory");
#endif
}

// Reads a value at this place of the program: the compiler delays a plain read until it knows that the value is needed.
__device__ __forceinline__ uint32_t loadNow(const uint32_t* at)
{
    uint32_t value;
    asm volatile("ld.relaxed.gpu.global.u32 %0, [%1];" : "=r"(value) : "l"(at));
    return value;
}

// Reads a counter that another block adds to; what that block wrote before it counted is then visible.
__device__ __forceinline__ uint32_t loadAcquire(const uint32_t* at)
{
    uint32_t value;
    asm volatile("ld.acquire.gpu.global.u32 %0, [%1];" : "=r"(value) : "l"(at) : "memory");
    return value;
}

// Time in nanoseconds by a clock common to all multiprocessors; on an H200 it advances in steps of 32.
__device__ __forceinline__ unsigned long long deviceNanoseconds()
{
    unsigned long long now;
    asm volatile("mov.u64 %0, %globaltimer;" : "=l"(now));
    return now;
}

} // namespace gsc
