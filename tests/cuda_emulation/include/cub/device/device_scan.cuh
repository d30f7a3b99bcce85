// SPDX-License-Identifier: Apache-2.0
// Stands for CUB's header.
#pragma once

#include <cuda_runtime.h>

#include <cstring>

namespace gsc_emulation {

template <typename T>
void scanKernel(unsigned char* scratch, size_t bytes, T* data, uint32_t count)
{
    std::memset(scratch, 0xff, bytes); // as CUB may
    T sum{};
    for (uint32_t i = 0; i < count; ++i) {
        const T v = data[i];
        data[i] = sum;
        sum += v;
    }
}

} // namespace gsc_emulation

namespace cub {

struct DeviceScan {
    template <typename T>
    static cudaError_t ExclusiveSum(void* scratch, size_t& bytes, T* data, uint32_t count,
                                    cudaStream_t stream = nullptr)
    {
        const size_t needed = 512 + size_t(count) / 128;
        if (scratch == nullptr) {
            bytes = needed;
            return cudaSuccess;
        }
        if (bytes < needed)
            return cudaErrorInvalidValue;
        cudaLaunchConfig_t config{};
        config.gridDim = config.blockDim = dim3(1);
        config.stream = stream;
        return cudaLaunchKernelEx(&config, gsc_emulation::scanKernel<T>, static_cast<unsigned char*>(scratch), needed,
                                  data, count);
    }
};

} // namespace cub
