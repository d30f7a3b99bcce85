// SPDX-License-Identifier: Apache-2.0
// Launching of kernels, in plain C++ so that the same source also builds for the emulation that tests run on.
#pragma once

#include "kernels/cuda/cuda_check.h"

#include <cuda_runtime.h>

#include <cstddef>
#include <cstdint>

namespace gsc {

// Asynchronous. Throws Error (Device, Unsupported) if the launch itself fails. beside: starts as soon as the kernel before
// it says launchDependents() and leaves it room, and must say waitForEarlier() before it ends or reads what that writes.
template <typename... Parameters, typename... Arguments>
void launchCudaAs(bool beside, void (*kernel)(Parameters...), dim3 blocks, uint32_t threads, size_t shared_bytes,
                  cudaStream_t stream, const Arguments&... arguments)
{
    if (shared_bytes > 48 * 1024) // more than a kernel has unasked; captured frames ask once
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

// Brings a kernel to the device, which else happens at its first launch and takes a tenth of a millisecond or more.
template <typename... Parameters>
void loadKernel(void (*kernel)(Parameters...))
{
    cudaFuncAttributes attributes{};
    GSC_CUDA_CHECK(cudaFuncGetAttributes(&attributes, reinterpret_cast<const void*>(kernel)));
}

// Launches a kernel as launchCudaAs() does, to start after all that was launched before it.
template <typename... Parameters, typename... Arguments>
void launchCuda(void (*kernel)(Parameters...), dim3 blocks, uint32_t threads, size_t shared_bytes, cudaStream_t stream,
                const Arguments&... arguments)
{
    launchCudaAs(false, kernel, blocks, threads, shared_bytes, stream, arguments...);
}

} // namespace gsc
