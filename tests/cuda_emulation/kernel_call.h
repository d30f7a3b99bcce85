// SPDX-License-Identifier: Apache-2.0
// A launch of a kernel with its own copy of the arguments.
#pragma once

#include <cuda_runtime_api.h>

#include <array>
#include <memory>
#include <tuple>
#include <utility>

namespace gsc_emulation {

class KernelCall {
public:
    KernelCall(const void* function, dim3 grid, dim3 block, size_t shared_bytes)
        : m_function(function), m_grid(grid), m_block(block), m_shared_bytes(shared_bytes)
    {
    }
    virtual ~KernelCall() = default;
    KernelCall(const KernelCall&) = delete;
    KernelCall& operator=(const KernelCall&) = delete;

    virtual void runThread() const = 0;
    [[nodiscard]] virtual void** arguments() = 0; // pointers to the copies
    [[nodiscard]] virtual std::shared_ptr<KernelCall> with(const cudaKernelNodeParams& params) const = 0;

    [[nodiscard]] const void* function() const { return m_function; }
    [[nodiscard]] dim3 grid() const { return m_grid; }
    [[nodiscard]] dim3 block() const { return m_block; }
    [[nodiscard]] size_t sharedBytes() const { return m_shared_bytes; }

private:
    const void* m_function;
    dim3 m_grid, m_block;
    size_t m_shared_bytes;
};

template <typename... Parameters>
class KernelCallOf final : public KernelCall {
public:
    using Kernel = void (*)(Parameters...);

    template <typename... Arguments>
    KernelCallOf(Kernel kernel, dim3 grid, dim3 block, size_t shared_bytes, Arguments&&... values)
        : KernelCall(reinterpret_cast<const void*>(kernel), grid, block, shared_bytes), m_kernel(kernel),
          m_values(std::forward<Arguments>(values)...)
    {
        std::apply([&](auto&... v) { m_pointers = {static_cast<void*>(&v)...}; }, m_values);
    }

    void runThread() const override { std::apply(m_kernel, m_values); }
    void** arguments() override { return m_pointers.data(); }
    std::shared_ptr<KernelCall> with(const cudaKernelNodeParams& params) const override
    {
        return fromPointers(params, std::index_sequence_for<Parameters...>());
    }

private:
    template <size_t... kIndex>
    std::shared_ptr<KernelCall> fromPointers(const cudaKernelNodeParams& params, std::index_sequence<kIndex...>) const
    {
        return std::make_shared<KernelCallOf>(m_kernel, params.gridDim, params.blockDim, params.sharedMemBytes,
                                              *static_cast<const Parameters*>(params.kernelParams[kIndex])...);
    }

    Kernel m_kernel;
    std::tuple<Parameters...> m_values;
    std::array<void*, sizeof...(Parameters)> m_pointers;
};

// Runs the kernel, or notes it where the stream is captured.
cudaError_t submit(cudaStream_t stream, std::shared_ptr<KernelCall> call);

} // namespace gsc_emulation
