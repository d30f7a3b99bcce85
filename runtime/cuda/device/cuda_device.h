// SPDX-License-Identifier: Apache-2.0
// Owns a device's resources other than memory: context, streams, events.
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
    // Returns the milliseconds from `before` to this event; both must have passed.
    [[nodiscard]] double since(const CudaEvent& before) const
    {
        float ms = 0;
        GSC_CUDA_CHECK(cudaEventElapsedTime(&ms, before.handle, handle));
        return ms;
    }
};

// An object in page-locked host memory, so that the copy of a frame's counters to it is asynchronous.
template <typename T>
struct Pinned {
    T* data = nullptr;

    Pinned() { GSC_CUDA_CHECK(cudaMallocHost(reinterpret_cast<void**>(&data), sizeof(T))); }
    ~Pinned() { cudaFreeHost(data); }
    Pinned(const Pinned&) = delete;
    Pinned& operator=(const Pinned&) = delete;
};

// Limits of a device that determine the size of launches.
struct CudaLimits {
    uint32_t processors = 0;
    size_t shared_bytes = 0; // most shared memory of a block, bytes
};

// A device that a renderer uses. The constructor makes it the thread's current device. A lost device (after a failed
// kernel) is reset for the whole process when its last user is destroyed, and can then be opened again.
class CudaDevice {
public:
    // throws the Error that lookAtCudaDevice() reports for a device that cannot be used
    explicit CudaDevice(int ordinal);
    ~CudaDevice();
    CudaDevice(const CudaDevice&) = delete;
    CudaDevice& operator=(const CudaDevice&) = delete;

    // Marks the device as lost. Call it after an error that only a broken context causes.
    void noteLost() const;

    // Makes the device the calling thread's current one; that may be another thread than before.
    void use() const { GSC_CUDA_CHECK(cudaSetDevice(m_ordinal)); }

    [[nodiscard]] int ordinal() const { return m_ordinal; }
    [[nodiscard]] const CudaLimits& limits() const { return m_limits; }
    [[nodiscard]] DeviceFacts facts() const;

    // Device memory that the driver took for this process before the process asked for any: the context and the
    // kernels' code. 0 if the driver's management library does not tell. It is the increase of the memory in use when
    // the first context was made, plus 32 MiB for code that is loaded later. It is wrong if another process takes or
    // frees memory at that moment.
    [[nodiscard]] uint64_t contextBytes() const;

private:
    int m_ordinal;
    CudaLimits m_limits;
};

} // namespace gsc
