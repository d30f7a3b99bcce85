// SPDX-License-Identifier: Apache-2.0
// Launching of kernels, in plain C++ so that the same source also builds for the emulation that tests run on.
#pragma once

#include "kernels/common/cuda_check.h"

#include <cuda_runtime.h>

#include <cstddef>
#include <cstdint>

// A kernel's dynamic shared memory.
#ifdef GSC_CUDA_EMULATION
#define GSC_DYNAMIC_SHARED(name) unsigned char* const name = gsc_emulation::dynamicShared()
#define GSC_NO_INLINE
#else
#define GSC_NO_INLINE __noinline__ // what is rare keeps its registers to itself
#define GSC_DYNAMIC_SHARED(name) extern __shared__ __align__(16) unsigned char name[]
#endif

namespace gsc {

// Asynchronous. Throws Error (Device, Unsupported) if the launch itself fails.
template <typename... Parameters, typename... Arguments>
void launchCuda(void (*kernel)(Parameters...), dim3 blocks, uint32_t threads, size_t shared_bytes, cudaStream_t stream,
                const Arguments&... arguments)
{
    cudaLaunchConfig_t config{};
    config.gridDim = blocks;
    config.blockDim = dim3(threads);
    config.dynamicSmemBytes = shared_bytes;
    config.stream = stream;
    GSC_CUDA_CHECK(cudaLaunchKernelEx(&config, kernel, arguments...));
}

// Lets a kernel take more shared memory than the 48 KiB that any may.
template <typename... Parameters>
void raiseSharedLimit(void (*kernel)(Parameters...), size_t bytes)
{
    GSC_CUDA_CHECK(cudaFuncSetAttribute(reinterpret_cast<const void*>(kernel),
                                        cudaFuncAttributeMaxDynamicSharedMemorySize, int(bytes)));
}

} // namespace gsc
