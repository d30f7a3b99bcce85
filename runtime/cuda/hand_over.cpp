// SPDX-License-Identifier: Apache-2.0
#include "runtime/cuda/hand_over.h"

#if defined(GSC_HAVE_CUDA)
#include "runtime/cuda/device/cuda_device.h"

#include <algorithm>
#include <map>
#include <optional>
#endif

namespace gsc {

#if defined(GSC_HAVE_CUDA)

namespace {

class CudaHandOver final : public HandOver {
public:
    CudaHandOver(int ordinal, int semaphore_file) : m_device(ordinal)
    {
        m_stream.emplace();
        cudaExternalSemaphoreHandleDesc description{};
        description.type = cudaExternalSemaphoreHandleTypeTimelineSemaphoreFd;
        description.handle.fd = semaphore_file;
        GSC_CUDA_CHECK(cudaImportExternalSemaphore(&m_semaphore, &description));
    }

    ~CudaHandOver() override
    {
        (void)cudaSetDevice(m_device.ordinal());
        m_stream.reset(); // destroys the stream after its copies have ended
        for (const auto& [id, block] : m_blocks)
            drop(block);
        (void)cudaDestroyExternalSemaphore(m_semaphore);
        (void)cudaGetLastError();
    }

    void addBlock(uint32_t id, int file, size_t bytes) override
    {
        m_device.use();
        Block block;
        cudaExternalMemoryHandleDesc description{};
        description.type = cudaExternalMemoryHandleTypeOpaqueFd;
        description.handle.fd = file;
        description.size = bytes;
        GSC_CUDA_CHECK(cudaImportExternalMemory(&block.memory, &description));
        m_blocks.emplace(id, block);
        cudaExternalMemoryBufferDesc buffer{};
        buffer.size = bytes;
        GSC_CUDA_CHECK(cudaExternalMemoryGetMappedBuffer(&m_blocks.at(id).mapped, block.memory, &buffer));
    }

    void dropBlock(uint32_t id) override
    {
        m_device.use();
        GSC_CUDA_CHECK(cudaStreamSynchronize(m_stream->handle));
        drop(m_blocks.at(id));
        m_blocks.erase(id);
    }

    void copy(uint32_t id, size_t offset, const void* from, size_t bytes) override
    {
        m_device.use();
        GSC_CUDA_CHECK(cudaMemcpyAsync(static_cast<std::byte*>(m_blocks.at(id).mapped) + offset, from, bytes,
                                       cudaMemcpyDeviceToDevice, m_stream->handle));
    }

    void signal(uint64_t value) override
    {
        m_device.use();
        cudaExternalSemaphoreSignalParams parameters{};
        parameters.params.fence.value = value;
        GSC_CUDA_CHECK(cudaSignalExternalSemaphoresAsync(&m_semaphore, &parameters, 1, m_stream->handle));
    }

private:
    struct Block {
        cudaExternalMemory_t memory = nullptr;
        void* mapped = nullptr;
    };
    static void drop(const Block& block)
    {
        (void)cudaFree(block.mapped); // removes the mapping of the block
        (void)cudaDestroyExternalMemory(block.memory);
    }

    CudaDevice m_device;
    std::optional<CudaStream> m_stream;
    cudaExternalSemaphore_t m_semaphore = nullptr;
    std::map<uint32_t, Block> m_blocks;
};

} // namespace

std::optional<std::array<unsigned char, 16>> deviceUuid(const DeviceId& device)
{
    cudaDeviceProp facts{};
    if (device.backend != "cuda" || cudaGetDeviceProperties(&facts, device.ordinal) != cudaSuccess) {
        (void)cudaGetLastError();
        return std::nullopt;
    }
    std::array<unsigned char, 16> uuid{};
    std::copy_n(reinterpret_cast<const unsigned char*>(facts.uuid.bytes), uuid.size(), uuid.begin());
    return uuid;
}

std::unique_ptr<HandOver> makeHandOver(const DeviceId& device, int semaphore_file)
{
    if (device.backend != "cuda")
        return nullptr;
    return std::make_unique<CudaHandOver>(device.ordinal, semaphore_file);
}

#else

std::optional<std::array<unsigned char, 16>> deviceUuid(const DeviceId&)
{
    return std::nullopt;
}

std::unique_ptr<HandOver> makeHandOver(const DeviceId&, int)
{
    return nullptr;
}

#endif

} // namespace gsc
