// SPDX-License-Identifier: Apache-2.0
// Error handling of CUDA calls. Destructors do not check: there is nothing left to act on.
#pragma once

#include <cuda_runtime_api.h>

namespace gsc {

// Device codes that say "this build", not "this machine": the caller may choose another backend.
inline bool isUnsupportedDevice(cudaError_t code)
{
    return code == cudaErrorNoKernelImageForDevice || code == cudaErrorUnsupportedPtxVersion ||
           code == cudaErrorInvalidDeviceFunction;
}

// Error(OutOfMemory, Unsupported or Device). Elsewhere, so that kernels, compiled once per architecture, need no strings.
[[noreturn]] void throwCuda(cudaError_t code, const char* call);

} // namespace gsc

#define GSC_CUDA_CHECK(call)                                                                                           \
    do {                                                                                                               \
        const cudaError_t gsc_cuda_code = (call);                                                                      \
        if (gsc_cuda_code != cudaSuccess)                                                                              \
            ::gsc::throwCuda(gsc_cuda_code, #call);                                                                    \
    } while (0)
