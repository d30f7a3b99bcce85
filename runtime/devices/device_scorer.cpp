// SPDX-License-Identifier: Apache-2.0
#include "runtime/devices/device_scorer.h"

#if defined(GSC_HAVE_CUDA)
#include "runtime/cuda/picture_scorer_cuda.h"
#endif

namespace gsc {

std::unique_ptr<PictureScorer> makeDeviceScorer([[maybe_unused]] const Renderer& renderer)
{
#if defined(GSC_HAVE_CUDA)
    if (!renderer.onHost() && renderer.id().backend == "cuda")
        return makeCudaScorer(renderer.id().ordinal);
#endif
    return nullptr;
}

uint64_t freeDeviceBytes([[maybe_unused]] const DeviceId& device)
{
#if defined(GSC_HAVE_CUDA)
    if (device.backend == "cuda")
        return freeCudaBytes(device.ordinal);
#endif
    return 0;
}

} // namespace gsc
