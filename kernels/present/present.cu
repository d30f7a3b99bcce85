// SPDX-License-Identifier: Apache-2.0
#include "kernels/present/present_cuda.h"

#include "kernels/cuda/launch.cuh"
#include "kernels/present/pixel.h"

#include <algorithm>

namespace gsc {

namespace {

constexpr uint32_t kThreads = 256;

template <typename Pixel, Pixel (*kOf)(const float*)>
__device__ __forceinline__ void store(const PresentView& args, uint32_t x, uint32_t y, const float* rgb)
{
    static_assert(sizeof(Pixel) == 4 || sizeof(Pixel) == 8);
    using Word = std::conditional_t<sizeof(Pixel) == 4, unsigned, uint2>;
    const Pixel pixel = kOf(rgb);
    Word word;
    memcpy(&word, &pixel, sizeof(word));
    if (args.target.kind == FrameTarget::Kind::Surface)
        surf2Dwrite(word, cudaSurfaceObject_t(args.target.surface), int(x * sizeof(Word)), int(y));
    else
        reinterpret_cast<Word*>(static_cast<unsigned char*>(args.target.pixels) + y * args.target.pitch)[x] = word;
}

__global__ void __launch_bounds__(kThreads) presentKernel(const __grid_constant__ PresentCudaArgs all)
{
    const PresentView& args = all.views[blockIdx.z];
    const uint32_t x = args.columns.first + blockIdx.x * kThreads + threadIdx.x, y = blockIdx.y;
    if (x >= args.columns.end || y >= args.height)
        return;
    // false for pixels that the lens hides, of which the image holds nothing
    const bool seen = args.lens.shows(x / kLensSquare, y / kLensSquare);
    const size_t at = size_t(y) * args.width + x;
    const auto depth = [&] { return seen ? args.depth[at] : INFINITY; };
    if (args.target.depth_surface != 0)
        surf2Dwrite(depth(), cudaSurfaceObject_t(args.target.depth_surface), int(x * sizeof(float)), int(y));
    else if (args.target.depth != nullptr)
        reinterpret_cast<float*>(reinterpret_cast<unsigned char*>(args.target.depth) + y * args.target.depth_pitch)[x] =
            depth();
    float rgb[3] = {};
    for (uint32_t c = 0; seen && c < 3; ++c)
        rgb[c] = args.image[at * 3 + c];
    switch (args.target.format) {
    case PixelFormat::Rgb32f: {
        float* const to =
            reinterpret_cast<float*>(static_cast<unsigned char*>(args.target.pixels) + y * args.target.pitch) + 3 * x;
        for (int c = 0; c < 3; ++c)
            to[c] = rgb[c];
        break;
    }
    case PixelFormat::Rgba16f:
        store<PixelHalves, pixelHalvesOf>(args, x, y, rgb);
        break;
    case PixelFormat::Rgba8:
        store<PixelBytes, pixelBytesOf>(args, x, y, rgb);
        break;
    case PixelFormat::Bgra8:
        store<PixelBytesBlueFirst, pixelBytesBlueFirstOf>(args, x, y, rgb);
        break;
    }
}

} // namespace

void presentCuda(const PresentCudaArgs& args, CUstream_st* stream)
{
    uint32_t width = 0, height = 0;
    for (uint32_t v = 0; v < args.count; ++v) {
        width = std::max(width, args.views[v].columns.end - args.views[v].columns.first);
        height = std::max(height, args.views[v].height);
    }
    launchCuda(presentKernel, dim3((width + kThreads - 1) / kThreads, height, args.count), kThreads, 0, stream, args);
}

} // namespace gsc
