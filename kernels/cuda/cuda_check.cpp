// SPDX-License-Identifier: Apache-2.0
#include "kernels/cuda/cuda_check.h"

#include <gsc/error.h>

#include <cstring>

namespace gsc {

void throwCuda(cudaError_t code, const char* call)
{
    (void)cudaGetLastError(); // clears an error that is not sticky, so that the next launch does not report it
    ErrorCode kind = ErrorCode::Device;
    if (code == cudaErrorMemoryAllocation)
        kind = ErrorCode::OutOfMemory;
    else if (isUnsupportedDevice(code))
        kind = ErrorCode::Unsupported;
    throw Error(kind, "cuda",
                formatString("%.*s: %s (%s)", int(std::strcspn(call, "(")), call, cudaGetErrorString(code),
                             cudaGetErrorName(code)),
                "success", "draw on the CPU")
        .with({Setting::CpuBackend});
}

} // namespace gsc
