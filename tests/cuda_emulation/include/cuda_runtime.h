// SPDX-License-Identifier: Apache-2.0
// Stands for the CUDA toolkit's header.
#pragma once

#include <cuda_runtime_api.h>

#include "tests/cuda_emulation/intrinsics.h"
#include "tests/cuda_emulation/kernel_call.h"

template <typename... Parameters, typename... Arguments>
cudaError_t cudaLaunchKernelEx(const cudaLaunchConfig_t* config, void (*kernel)(Parameters...),
                               Arguments&&... arguments)
{
    return gsc_emulation::submit(config->stream, std::make_shared<gsc_emulation::KernelCallOf<Parameters...>>(
                                                     kernel, config->gridDim, config->blockDim,
                                                     config->dynamicSmemBytes, std::forward<Arguments>(arguments)...));
}

template <typename T>
void surf2Dwrite(T value, cudaSurfaceObject_t surface, int x, int y) // x in bytes
{
    const auto* const to = reinterpret_cast<const gsc_emulation::Surface*>(surface);
    std::memcpy(to->pixels + size_t(y) * to->pitch + size_t(x), &value, sizeof(value));
}

template <typename... Parameters>
cudaError_t cudaFuncGetAttributes(cudaFuncAttributes* attributes, void (*kernel)(Parameters...))
{
    return cudaFuncGetAttributes(attributes, reinterpret_cast<const void*>(kernel));
}
