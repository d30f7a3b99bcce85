// SPDX-License-Identifier: Apache-2.0
#include "runtime/cuda/picture_cuda.h"

#include "runtime/cuda/device/cuda_device.h"

#include <atomic>
#include <map>
#include <optional>
#include <utility>

namespace gsc {

namespace {

std::byte* allocateOnDevice(size_t bytes, int ordinal)
{
    GSC_CUDA_CHECK(cudaSetDevice(ordinal));
    void* block = nullptr;
    const cudaError_t code = cudaMalloc(&block, bytes);
    if (code == cudaErrorMemoryAllocation) {
        (void)cudaGetLastError();
        throw Error(ErrorCode::OutOfMemory, formatString("cuda:%d", ordinal),
                    formatString("a picture takes %zu bytes of device memory, which are not free", bytes), "enough",
                    "lower the budget of device memory, or draw smaller images")
            .with({Setting::DeviceMemory, Setting::ImageSize});
    }
    GSC_CUDA_CHECK(code);
    return static_cast<std::byte*>(block);
}

// Frees a block. The thread that held the picture last calls this; its current device is restored.
void freeOnDevice(std::byte* block, int ordinal)
{
    int own = ordinal;
    (void)cudaGetDevice(&own);
    (void)cudaSetDevice(ordinal);
    (void)cudaFree(block);
    (void)cudaSetDevice(own);
}

class CudaPictures final : public PictureMemory {
public:
    explicit CudaPictures(int ordinal)
        : m_ordinal(ordinal), m_pool(std::make_shared<BlockPool>(allocateOnDevice, freeOnDevice, ordinal))
    {
    }

    [[nodiscard]] FrameTarget::Kind kind() const override { return FrameTarget::Kind::Device; }
    std::shared_ptr<std::byte> take(size_t bytes) override
    {
        m_taken = true;
        return m_pool->take(bytes);
    }
    [[nodiscard]] bool takesFrom(const Renderer& renderer) const override
    {
        return renderer.id() == DeviceId{"cuda", m_ordinal};
    }
    bool lost() override
    {
        if (!m_taken)
            return false;
        size_t left = 0, total = 0;
        const bool gone = cudaSetDevice(m_ordinal) != cudaSuccess || cudaMemGetInfo(&left, &total) != cudaSuccess;
        (void)cudaGetLastError();
        if (gone)
            m_pool->forget();
        return gone;
    }
    [[nodiscard]] int ordinal() const { return m_ordinal; }

private:
    int m_ordinal;
    std::atomic<bool> m_taken = false;
    std::shared_ptr<BlockPool> m_pool;
};

// Copies pictures to another device. They are drawn in memory of the renderer's device, or of the host if that draws.
class CudaBridge final : public PictureBridge {
public:
    CudaBridge(int to, const Renderer& renderer)
        : m_from_host(renderer.onHost()), m_from(m_from_host ? to : renderer.id().ordinal), m_to(to), m_device(m_from)
    {
        m_stream.emplace();
        if (!m_from_host) { // refused, without error, between GPUs that cannot reach each other's memory
            (void)cudaDeviceEnablePeerAccess(m_to, 0);
            (void)cudaGetLastError();
        }
    }
    ~CudaBridge() override
    {
        (void)cudaSetDevice(m_from);
        m_stream.reset();
        for (const auto& [slot, own] : m_buffers)
            drop(own.first);
    }

    FrameTarget buffer(uint32_t slot, size_t bytes) override
    {
        auto& [block, size] = m_buffers[slot];
        if (size < bytes)
            guarded([&] {
                drop(std::exchange(block, nullptr));
                size = 0;
                block = m_from_host ? allocatePageLocked(bytes, 0) : allocateOnDevice(bytes, m_from);
                size = bytes;
            });
        FrameTarget target;
        target.kind = m_from_host ? FrameTarget::Kind::Host : FrameTarget::Kind::Device;
        target.pixels = block;
        return target;
    }

    void land(uint32_t slot, std::byte* picture, const PicturePart& part) override
    {
        guarded([&] {
            useDevice();
            std::byte *const from = m_buffers.at(slot).first + part.offset, *const to = picture + part.offset;
            if (m_from_host) {
                GSC_CUDA_CHECK(cudaMemcpy2DAsync(to, part.pitch, from, part.pitch, part.bytes, part.rows,
                                                 cudaMemcpyHostToDevice, m_stream->handle));
            } else if (part.bytes == part.pitch) {
                GSC_CUDA_CHECK(cudaMemcpyPeerAsync(to, m_to, from, m_from, part.bytes * part.rows, m_stream->handle));
            } else {
                cudaMemcpy3DPeerParms copy{};
                copy.srcDevice = m_from;
                copy.dstDevice = m_to;
                copy.srcPtr = {from, part.pitch, part.bytes, part.rows};
                copy.dstPtr = {to, part.pitch, part.bytes, part.rows};
                copy.extent = {part.bytes, part.rows, 1};
                GSC_CUDA_CHECK(cudaMemcpy3DPeerAsync(&copy, m_stream->handle));
            }
        });
    }

    void finish() override
    {
        guarded([&] {
            useDevice();
            GSC_CUDA_CHECK(cudaStreamSynchronize(m_stream->handle));
        });
    }

private:
    // Calls `act`; if it fails because a device is lost, marks that device as lost, since this may be where it first
    // shows.
    template <typename Act>
    void guarded(const Act& act)
    {
        try {
            act();
        } catch (const Error& e) {
            if (e.code() == ErrorCode::Device)
                m_device.noteLost();
            throw;
        }
    }
    void useDevice() const { m_device.use(); }
    void drop(std::byte* block) const { m_from_host ? freePageLocked(block, 0) : freeOnDevice(block, m_from); }

    bool m_from_host;
    int m_from, m_to;
    CudaDevice m_device; // declared first, so that a lost device is reset only after the stream and buffers are gone
    std::optional<CudaStream> m_stream;
    std::map<uint32_t, std::pair<std::byte*, size_t>> m_buffers; // buffers and their bytes, by slot
};

} // namespace

// Allocates memory of the process and locks it. Memory from the driver would be lost if a device is reset.
std::byte* allocatePageLocked(size_t bytes, int place)
{
    std::byte* const block = allocatePages(bytes, place);
    (void)cudaHostRegister(block, bytes, cudaHostRegisterPortable); // without locking, copies work, too, but slower
    (void)cudaGetLastError();
    return block;
}

void freePageLocked(std::byte* block, int place)
{
    (void)cudaHostUnregister(block);
    (void)cudaGetLastError();
    freePages(block, place);
}

std::shared_ptr<PictureMemory> cudaPictures(int ordinal)
{
    return std::make_shared<CudaPictures>(ordinal);
}

std::unique_ptr<PictureBridge> cudaBridge(const PictureMemory& memory, const Renderer& renderer)
{
    const auto* const pictures = dynamic_cast<const CudaPictures*>(&memory);
    return pictures == nullptr ? nullptr : std::make_unique<CudaBridge>(pictures->ordinal(), renderer);
}

std::string cudaLink(int from, int to)
{
    int reach = 0;
    if (cudaDeviceCanAccessPeer(&reach, from, to) != cudaSuccess || reach == 0) {
        (void)cudaGetLastError();
        return "host";
    }
    int atomics = 0; // devices linked by NVLink have native atomics on each other's memory, those on PCIe have not
    (void)cudaDeviceGetP2PAttribute(&atomics, cudaDevP2PAttrNativeAtomicSupported, from, to);
    return atomics != 0 ? "NVLink" : "PCIe";
}

} // namespace gsc
