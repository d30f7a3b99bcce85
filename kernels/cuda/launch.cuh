// SPDX-License-Identifier: Apache-2.0
// Launches kernels, in plain C++ so that the same source can be built for the emulation that tests run on.
#pragma once

#include "kernels/cuda/cuda_check.h"

#include <cuda_runtime.h>

#include <cstddef>
#include <cstdint>

namespace gsc {

// Launches a kernel, asynchronously. Throws Error (Device, Unsupported) if the launch itself fails. beside: the kernel
// starts as soon as the kernel before it calls launchDependents() and leaves it room; it must call waitForEarlier()
// before it reads what that kernel writes, and before it ends.
template <typename... Parameters, typename... Arguments>
void launchCudaAs(bool beside, void (*kernel)(Parameters...), dim3 blocks, uint32_t threads, size_t shared_bytes,
                  cudaStream_t stream, const Arguments&... arguments)
{
    // more shared memory than a kernel has without asking; in a captured graph it asks once
    if (shared_bytes > 48 * 1024)
        GSC_CUDA_CHECK(cudaFuncSetAttribute(reinterpret_cast<const void*>(kernel),
                                            cudaFuncAttributeMaxDynamicSharedMemorySize, int(shared_bytes)));
    cudaLaunchAttribute attribute{};
    attribute.id = cudaLaunchAttributeProgrammaticStreamSerialization;
    attribute.val.programmaticStreamSerializationAllowed = 1;
    cudaLaunchConfig_t config{};
    config.gridDim = blocks;
    config.blockDim = dim3(threads);
    config.dynamicSmemBytes = shared_bytes;
    config.stream = stream;
    config.attrs = beside ? &attribute : nullptr;
    config.numAttrs = beside ? 1 : 0;
    GSC_CUDA_CHECK(cudaLaunchKernelEx(&config, kernel, arguments...));
}

// Brings a kernel to the device now. Otherwise its first launch does so, which takes a tenth of a millisecond or more.
template <typename... Parameters>
void loadKernel(void (*kernel)(Parameters...))
{
    cudaFuncAttributes attributes{};
    GSC_CUDA_CHECK(cudaFuncGetAttributes(&attributes, reinterpret_cast<const void*>(kernel)));
}

// Launches a kernel as launchCudaAs() does, but it starts after all that was launched before it has ended.
template <typename... Parameters, typename... Arguments>
void launchCuda(void (*kernel)(Parameters...), dim3 blocks, uint32_t threads, size_t shared_bytes, cudaStream_t stream,
                const Arguments&... arguments)
{
    launchCudaAs(false, kernel, blocks, threads, shared_bytes, stream, arguments...);
}

} // namespace gsc
