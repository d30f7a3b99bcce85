// SPDX-License-Identifier: Apache-2.0
// Error handling of CUDA calls. Destructors do not check: there is nothing left to act on.
#pragma once

#include "format/error.h"

#include <cuda_runtime_api.h>

#include <cstring>

namespace gsc {

// Device codes that say "this build", not "this machine": the caller may choose another backend.
inline bool isUnsupportedDevice(cudaError_t code)
{
    return code == cudaErrorNoKernelImageForDevice || code == cudaErrorUnsupportedPtxVersion ||
           code == cudaErrorInvalidDeviceFunction;
}

[[noreturn]] inline void throwCuda(cudaError_t code, const char* call)
{
    (void)cudaGetLastError(); // an error that is not sticky must not show up at the next launch
    ErrorCode kind = ErrorCode::Device;
    if (code == cudaErrorMemoryAllocation)
        kind = ErrorCode::OutOfMemory;
    else if (isUnsupportedDevice(code))
        kind = ErrorCode::Unsupported;
    throw Error(kind,
                formatString("cuda: %.*s: %s (%s), expected success; try --backend cpu", int(std::strcspn(call, "(")),
                             call, cudaGetErrorString(code), cudaGetErrorName(code)));
}

} // namespace gsc

#define GSC_CUDA_CHECK(call)                                                                                           \
    do {                                                                                                               \
        const cudaError_t gsc_cuda_code = (call);                                                                      \
        if (gsc_cuda_code != cudaSuccess)                                                                              \
            ::gsc::throwCuda(gsc_cuda_code, #call);                                                                    \
    } while (0)
