// SPDX-License-Identifier: Apache-2.0
// Turns errors of CUDA calls into Error. Destructors do not check: they could do nothing about an error.
#pragma once

#include <cuda_runtime_api.h>

namespace gsc {

// Returns true for codes that mean "not with this build" rather than "not on this machine": the caller may choose
// another backend.
inline bool isUnsupportedDevice(cudaError_t code)
{
    return code == cudaErrorNoKernelImageForDevice || code == cudaErrorUnsupportedPtxVersion ||
           code == cudaErrorInvalidDeviceFunction;
}

// Throws Error(OutOfMemory, Unsupported or Device). Not inline: kernels, compiled once per architecture, need no
// strings.
[[noreturn]] void throwCuda(cudaError_t code, const char* call);

} // namespace gsc

#define GSC_CUDA_CHECK(call)                                                                                           \
    do {                                                                                                               \
        const cudaError_t gsc_cuda_code = (call);                                                                      \
        if (gsc_cuda_code != cudaSuccess)                                                                              \
            ::gsc::throwCuda(gsc_cuda_code, #call);                                                                    \
    } while (0)
