// SPDX-License-Identifier: Apache-2.0
// Owners of a device's resources, other than memory: context, streams, events.
#pragma once

#include "kernels/cuda/cuda_check.h"
#include "kernels/frame/device_model.h"
#include <gsc/device.h>

#include <cstddef>

namespace gsc {

struct CudaStream {
    cudaStream_t handle = nullptr;

    CudaStream() { GSC_CUDA_CHECK(cudaStreamCreateWithFlags(&handle, cudaStreamNonBlocking)); }
    ~CudaStream()
    {
        cudaStreamSynchronize(handle);
        cudaStreamDestroy(handle);
    }
    CudaStream(const CudaStream&) = delete;
    CudaStream& operator=(const CudaStream&) = delete;
};

struct CudaEvent {
    cudaEvent_t handle = nullptr;

    CudaEvent() { GSC_CUDA_CHECK(cudaEventCreate(&handle)); }
    ~CudaEvent() { cudaEventDestroy(handle); }
    CudaEvent(const CudaEvent&) = delete;
    CudaEvent& operator=(const CudaEvent&) = delete;

    void record(const CudaStream& stream) const { GSC_CUDA_CHECK(cudaEventRecord(handle, stream.handle)); }
    // Milliseconds from `before` to this; both have passed.
    [[nodiscard]] double since(const CudaEvent& before) const
    {
        float ms = 0;
        GSC_CUDA_CHECK(cudaEventElapsedTime(&ms, before.handle, handle));
        return ms;
    }
};

// Object in page-locked host memory, so that copying a frame's report to it is asynchronous.
template <typename T>
struct Pinned {
    T* data = nullptr;

    Pinned() { GSC_CUDA_CHECK(cudaMallocHost(reinterpret_cast<void**>(&data), sizeof(T))); }
    ~Pinned() { cudaFreeHost(data); }
    Pinned(const Pinned&) = delete;
    Pinned& operator=(const Pinned&) = delete;
};

// Limits of a device that launches are sized by.
struct CudaLimits {
    uint32_t processors = 0;
    size_t shared_bytes = 0; // most shared memory of a block
};

// A device that a renderer uses; it is made the thread's. A lost device (a kernel failed) is reset for the whole
// process when its last user is destroyed, and can then be opened anew.
class CudaDevice {
public:
    explicit CudaDevice(int ordinal); // Throws Error as lookAtCudaDevice() says
    ~CudaDevice();
    CudaDevice(const CudaDevice&) = delete;
    CudaDevice& operator=(const CudaDevice&) = delete;

    // Marks the device as lost, after an error that only a broken context causes.
    void noteLost() const;

    // The caller's thread may be a new one.
    void use() const { GSC_CUDA_CHECK(cudaSetDevice(m_ordinal)); }

    [[nodiscard]] int ordinal() const { return m_ordinal; }
    [[nodiscard]] const CudaLimits& limits() const { return m_limits; }
    [[nodiscard]] DeviceFacts facts() const;

    // Device memory that the driver took for this process before it asked for any: the context and the kernels' code. 0
    // where the driver's management library does not tell. It is the memory in use that the first context added,
    // measured once, so right if no other process takes or gives back memory at that moment, and 32 MiB for code that
    // is loaded later.
    [[nodiscard]] uint64_t contextBytes() const;

private:
    int m_ordinal;
    CudaLimits m_limits;
};

} // namespace gsc
