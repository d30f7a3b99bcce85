// SPDX-License-Identifier: Apache-2.0
#include "runtime/devices/device_pictures.h"

#if defined(GSC_HAVE_CUDA)
#include "runtime/cuda/picture_cuda.h"
#endif

namespace gsc {

namespace {

class HostPictures final : public PictureMemory {
public:
    explicit HostPictures(bool page_locked) : m_pool(makePool(page_locked)) {}

    [[nodiscard]] FrameTarget::Kind kind() const override { return FrameTarget::Kind::Host; }
    std::shared_ptr<std::byte> take(size_t bytes) override { return m_pool->take(bytes); }
    [[nodiscard]] bool takesFrom(const Renderer&) const override { return true; }

private:
    static std::shared_ptr<BlockPool> makePool([[maybe_unused]] bool page_locked)
    {
#if defined(GSC_HAVE_CUDA)
        if (page_locked)
            return std::make_shared<BlockPool>(allocatePageLocked, freePageLocked, 0);
#endif
        return std::make_shared<BlockPool>(allocatePages, freePages, 0);
    }

    std::shared_ptr<BlockPool> m_pool;
};

} // namespace

std::shared_ptr<PictureMemory> hostPictures(bool page_locked)
{
    return std::make_shared<HostPictures>(page_locked);
}

std::shared_ptr<PictureMemory> devicePictures([[maybe_unused]] const DeviceId& device)
{
#if defined(GSC_HAVE_CUDA)
    if (device.backend == "cuda")
        return cudaPictures(device.ordinal);
#endif
    return hostPictures(false);
}

std::unique_ptr<PictureBridge> bridgeTo([[maybe_unused]] const PictureMemory& memory,
                                        [[maybe_unused]] const Renderer& renderer)
{
#if defined(GSC_HAVE_CUDA)
    return cudaBridge(memory, renderer);
#else
    return nullptr; // host memory is reached from every renderer, so no bridge is needed
#endif
}

} // namespace gsc
