// SPDX-License-Identifier: Apache-2.0
#include "kernels/metrics/block_sum.cuh"
#include "kernels/metrics/filter.cuh"

namespace gsc {

namespace {

__global__ void __launch_bounds__(kSquareThreads) opponentKernel(const __grid_constant__ OpponentCudaArgs args)
{
    const SquarePixel pixel = squarePixel(args.width, args.height);
    if (!pixel.there)
        return;
    const Vec3d color = opponentOf(args.image + 3 * pixel.at);
    args.planes[0][pixel.at] = float(color.x);
    args.planes[1][pixel.at] = float(color.y);
    args.planes[2][pixel.at] = float(color.z);
}

__global__ void __launch_bounds__(kSquareThreads) rowsKernel(const __grid_constant__ RowFilterCudaArgs args)
{
    const SquarePixel pixel = squarePixel(args.width, args.height);
    if (!pixel.there)
        return;
    const float* const row = args.plane + size_t(pixel.y) * args.width;
    for (uint32_t i = 0; i < args.count; ++i) {
        const FilterWeights& filter = args.filters[i];
        double sum = 0;
        for (int32_t k = -filter.radius; k <= filter.radius; ++k) {
            const float value = row[nearestInside(int32_t(pixel.x) + k, args.width)];
            sum += filter.weight[k + filter.radius] * double(args.lightness ? (value + 16) / 116 : value);
        }
        args.out[i][pixel.at] = float(sum);
    }
}

__global__ void __launch_bounds__(kSquareThreads) columnsKernel(const __grid_constant__ ColumnFilterCudaArgs args)
{
    const SquarePixel pixel = squarePixel(args.width, args.height);
    if (!pixel.there)
        return;
    float sum = 0;
    for (uint32_t i = 0; i < args.count; ++i)
        sum += args.shares[i] * columnSum(args.planes[i], args.width, args.height, pixel.x, pixel.y, args.filters[i]);
    args.out[pixel.at] = sum;
}

__global__ void __launch_bounds__(kSquareThreads) featuresKernel(const __grid_constant__ FeatureCudaArgs args)
{
    const SquarePixel pixel = squarePixel(args.width, args.height);
    if (!pixel.there)
        return;
    const auto along = [&](const float* plane, const FilterWeights& filter) {
        return columnSum(plane, args.width, args.height, pixel.x, pixel.y, filter);
    };
    args.out[pixel.at] = {hypotf(along(args.first, args.blur), along(args.blurred, args.edge)),
                          hypotf(along(args.second, args.blur), along(args.blurred, args.point))};
}

__global__ void __launch_bounds__(kSquareThreads) flipKernel(const __grid_constant__ FlipCudaArgs args)
{
    __shared__ SquareFlip shared[kSquareThreads];
    const SquarePixel pixel = squarePixel(args.width, args.height);
    SquareFlip own{};
    if (pixel.there) {
        const auto lab = [&](const float* const* planes) {
            return huntLabOfOpponent(planes[0][pixel.at], planes[1][pixel.at], planes[2][pixel.at]);
        };
        const auto color = float(flipColorError(lab(args.exact), lab(args.image), args.largest));
        const bool in_fovea = args.gaze.present && inFovea(args.gaze.gaze, pixel.x, pixel.y);
        own.error[in_fovea ? 0 : 1] = flipPixel(color, args.exact_features[pixel.at], args.image_features[pixel.at]);
    }
    const SquareFlip all = blockSum(own, shared, [](SquareFlip& sum, const SquareFlip& other) {
        sum.error[0] += other.error[0];
        sum.error[1] += other.error[1];
    });
    if (threadIdx.x == 0)
        args.squares[squareNumber()] = all;
}

// Launches a kernel with one thread for each pixel and one block for each square.
template <typename Args>
void launchPixels(void (*kernel)(Args), const Args& args, CUstream_st* stream)
{
    launchCuda(kernel, squaresOf(args.width, args.height), kSquareThreads, 0, stream, args);
}

} // namespace

void opponentCuda(const OpponentCudaArgs& args, CUstream_st* stream)
{
    launchPixels(opponentKernel, args, stream);
}

void filterRowsCuda(const RowFilterCudaArgs& args, CUstream_st* stream)
{
    launchPixels(rowsKernel, args, stream);
}

void filterColumnsCuda(const ColumnFilterCudaArgs& args, CUstream_st* stream)
{
    launchPixels(columnsKernel, args, stream);
}

void flipFeaturesCuda(const FeatureCudaArgs& args, CUstream_st* stream)
{
    launchPixels(featuresKernel, args, stream);
}

void flipSquaresCuda(const FlipCudaArgs& args, CUstream_st* stream)
{
    launchPixels(flipKernel, args, stream);
}

} // namespace gsc
