// SPDX-License-Identifier: Apache-2.0
// SIMD lanes are output channels. An input value is broadcast once and multiplied with the weights of two vectors of
// output channels. The sums of a tile of pixels stay in registers.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "runtime/metrics/convolve3x3.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "runtime/metrics/convolve3x3.h"

#include "kernels/simd/simd_math-inl.h"

#include <algorithm>
#include <cmath>
#include <utility>

#ifndef GSC_CONVOLVE_CHUNK
#define GSC_CONVOLVE_CHUNK
namespace gsc {
// Number of input channels that are added at once. Their weights (18 KiB) stay in the first-level cache while a strip
// of rows passes, and whole cache lines of each pixel are used.
constexpr uint32_t kConvolveChunk = 16;
constexpr uint32_t kTaps = 9;
} // namespace gsc
#endif

HWY_BEFORE_NAMESPACE();
namespace gsc {
namespace HWY_NAMESPACE {

// Pixels of a tile, two vectors of sums each: 24 of 32 registers with AVX-512, otherwise 12 of 16.
constexpr size_t kTilePixels = HWY_TARGET <= HWY_AVX3 ? 12 : 6;

// Adds `count` input channels at `in` to the sums of a tile. The sums start from `bias` if it is not null, else from
// `out`; `last`: negative sums become 0.
template <size_t... I>
HWY_INLINE void convolveTile(D d, std::index_sequence<I...>, const ConvolveArgs& args, const float* in,
                             const float* weight, uint32_t count, const float* bias, bool last, float* out)
{
    const size_t lanes = hn::Lanes(d), out_pixel = args.out_pixel, in_pixel = args.in_pixel;
    V low[] = {(bias != nullptr ? hn::LoadU(d, bias) : hn::LoadU(d, out + I * out_pixel))...};
    V high[] = {(bias != nullptr ? hn::LoadU(d, bias + lanes) : hn::LoadU(d, out + I * out_pixel + lanes))...};
    for (size_t ky = 0; ky < 3; ++ky)
        for (size_t kx = 0; kx < 3; ++kx) {
            const float* x = in + ky * args.in_row + kx * in_pixel;
            for (uint32_t c = 0; c < count; ++c, ++x, weight += kConvolveBlock) {
                const V w0 = hn::LoadU(d, weight), w1 = hn::LoadU(d, weight + lanes);
                ((low[I] = hn::MulAdd(hn::Set(d, x[I * in_pixel]), w0, low[I]),
                  high[I] = hn::MulAdd(hn::Set(d, x[I * in_pixel]), w1, high[I])),
                 ...);
            }
        }
    const V floor = last ? hn::Zero(d) : hn::Set(d, -std::numeric_limits<float>::infinity());
    (hn::StoreU(hn::Max(low[I], floor), d, out + I * out_pixel), ...);
    (hn::StoreU(hn::Max(high[I], floor), d, out + I * out_pixel + lanes), ...);
}

void convolveRows(const ConvolveArgs& args)
{
    const D d;
    const uint32_t step = uint32_t(2 * hn::Lanes(d)), tiles = args.tiles * uint32_t(kConvolveTile / kTilePixels);
    const float* block_weight = args.weight;
    for (uint32_t block = 0; block < args.out_channels; block += kConvolveBlock)
        for (uint32_t chunk = 0; chunk < args.in_channels; chunk += kConvolveChunk) {
            const uint32_t count = std::min(kConvolveChunk, args.in_channels - chunk);
            const bool last = chunk + count == args.in_channels;
            for (uint32_t channel = 0; channel < kConvolveBlock; channel += step)
                for (uint32_t y = 0; y < args.rows; ++y) {
                    const float* in = args.in + y * args.in_row + chunk;
                    float* out = args.out + y * args.out_row + block + channel;
                    const float* bias = chunk == 0 ? args.bias + block + channel : nullptr;
                    for (uint32_t tile = 0; tile < tiles; ++tile) {
                        convolveTile(d, std::make_index_sequence<kTilePixels>(), args, in, block_weight + channel,
                                     count, bias, last, out);
                        in += kTilePixels * args.in_pixel;
                        out += kTilePixels * args.out_pixel;
                    }
                }
            block_weight += size_t(kTaps) * count * kConvolveBlock;
        }
}

double unitDistanceRow(const float* a, const float* b, size_t pixel_pitch, uint32_t width, uint32_t channels,
                       const float* head)
{
    const D d;
    const size_t lanes = hn::Lanes(d);
    constexpr float kTiny = 1e-10f; // a constant of LPIPS: avoids division by zero for a pixel without any feature
    double total = 0;
    for (uint32_t x = 0; x < width; ++x, a += pixel_pitch, b += pixel_pitch) {
        V squares_a = hn::Zero(d), squares_b = hn::Zero(d), sum = hn::Zero(d);
        for (size_t c = 0; c < channels; c += lanes) {
            const V u = hn::LoadU(d, a + c), v = hn::LoadU(d, b + c);
            squares_a = hn::MulAdd(u, u, squares_a);
            squares_b = hn::MulAdd(v, v, squares_b);
        }
        const V scale_a = hn::Set(d, 1 / (std::sqrt(hn::GetLane(hn::SumOfLanes(d, squares_a))) + kTiny));
        const V scale_b = hn::Set(d, 1 / (std::sqrt(hn::GetLane(hn::SumOfLanes(d, squares_b))) + kTiny));
        for (size_t c = 0; c < channels; c += lanes) {
            const V difference = hn::Sub(hn::Mul(hn::LoadU(d, a + c), scale_a), hn::Mul(hn::LoadU(d, b + c), scale_b));
            sum = hn::MulAdd(hn::LoadU(d, head + c), hn::Mul(difference, difference), sum);
        }
        total += double(hn::GetLane(hn::SumOfLanes(d, sum)));
    }
    return total;
}

} // namespace HWY_NAMESPACE
} // namespace gsc
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace gsc {

HWY_EXPORT(convolveRows);
HWY_EXPORT(unitDistanceRow);

std::vector<float> packConvolution(std::span<const float> weight, uint32_t in_channels, uint32_t out_channels)
{
    std::vector<float> packed;
    packed.reserve(weight.size());
    for (uint32_t block = 0; block < out_channels; block += kConvolveBlock)
        for (uint32_t chunk = 0; chunk < in_channels; chunk += kConvolveChunk)
            for (uint32_t tap = 0; tap < kTaps; ++tap)
                for (uint32_t in = chunk; in < std::min(chunk + kConvolveChunk, in_channels); ++in)
                    for (uint32_t out = block; out < block + kConvolveBlock; ++out)
                        packed.push_back(weight[(size_t(out) * in_channels + in) * kTaps + tap]);
    return packed;
}

void convolve3x3(const ConvolveArgs& args)
{
    HWY_DYNAMIC_DISPATCH(convolveRows)(args);
}

double unitDistance(const float* a, const float* b, size_t pixel_pitch, uint32_t width, uint32_t channels,
                    const float* head)
{
    return HWY_DYNAMIC_DISPATCH(unitDistanceRow)(a, b, pixel_pitch, width, channels, head);
}

} // namespace gsc
#endif
