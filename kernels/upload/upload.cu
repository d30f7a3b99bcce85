// SPDX-License-Identifier: Apache-2.0
#include "kernels/upload/upload_cuda.h"

#include "kernels/cuda/launch.cuh"
#include "kernels/math/anchor.h"

#include <cuda_fp16.h>

namespace gsc {

namespace {

constexpr uint32_t kThreads = 128;

template <typename T>
__device__ const T* array(const UploadArgs& args, ChunkArray which, uint32_t i)
{
    const uint32_t a = uint32_t(which);
    return reinterpret_cast<const T*>(args.payload + args.layout.offset[a] + args.layout.stride[a] * i);
}

// Bits of the half float nearest to `v`. note: the largest finite one for larger values, because an infinity would make
// products infinite or NaN; NaN stays NaN
__device__ __forceinline__ uint16_t halfBits(float v)
{
    constexpr float kLargest = 65504.0f;
    if (v > kLargest)
        v = kLargest;
    else if (v < -kLargest)
        v = -kLargest;
    return __half_as_ushort(__float2half_rn(v));
}

// Number of steps of 2^power in a feature or offset of a compact model, at most `most` in magnitude.
__device__ __forceinline__ int32_t wholeSteps(float value, int power, int32_t most)
{
    return min(max(__float2int_rn(ldexpf(value, -power)), -most), most);
}

// Packs the anchors of a block into the arrays of a compact model, with powers of two instead of steps. Packs four
// features at a time.
__device__ __forceinline__ void packCompact(const UploadArgs& args, uint32_t first, uint32_t n)
{
    const size_t base = size_t(args.chunk.anchor_first) + first;
    __shared__ CompactShape shapes[kThreads];
    if (threadIdx.x < n) {
        const float* feature = array<float>(args, ChunkArray::Feature, first + threadIdx.x);
        const float* offset = array<float>(args, ChunkArray::Offset, first + threadIdx.x);
        const float* log_scale = array<float>(args, ChunkArray::Scale, first + threadIdx.x);
        float of_features = 0.0f, of_offsets = 0.0f;
        for (uint32_t i = 0; i < args.feat_dim; ++i)
            of_features = fmaxf(of_features, fabsf(feature[i]));
        for (uint32_t i = 0; i < 3 * args.n_offsets; ++i)
            if (isfinite(offset[i]))
                of_offsets = fmaxf(of_offsets, fabsf(offset[i]));
        CompactShape& shape = shapes[threadIdx.x];
        for (int a = 0; a < 3; ++a)
            shape.extent[a] = packExtent(expf(log_scale[3 + a]));
        shape.feature_power =
            // limited, so that 127 steps are no infinite half float
            int8_t(min(compactExponent(of_features, kCompactFeatureBits), 9));
        shape.offset_power = int8_t(compactExponent(of_offsets, kCompactOffsetBits));
        args.to.compact_shape[base + threadIdx.x] = shape;
    }
    __syncthreads();
    for (uint32_t i = threadIdx.x; i < n * args.feat_dim / 4; i += kThreads) {
        const float* feature = array<float>(args, ChunkArray::Feature, first) + size_t(4) * i;
        const int power = shapes[4 * i / args.feat_dim].feature_power;
        uint32_t packed = 0;
        for (int j = 0; j < 4; ++j)
            packed |= uint32_t(wholeSteps(feature[j], power, kCompactFeatureSteps) + 128) << 8 * j;
        args.to.compact_feature[base * args.feat_dim / 4 + i] = packed;
    }
    for (uint32_t i = threadIdx.x; i < n * args.n_offsets; i += kThreads) {
        const float* offset = array<float>(args, ChunkArray::Offset, first) + size_t(3) * i;
        const int power = shapes[i / args.n_offsets].offset_power;
        uint32_t packed = 0;
        bool finite = true;
        for (int a = 0; a < 3; ++a) {
            finite = finite && isfinite(offset[a]);
            const int32_t steps = finite ? wholeSteps(offset[a], power, kCompactOffsetSteps) : 0;
            packed |= uint32_t(steps + kCompactOffsetSteps + 1) << 10 * a;
        }
        const uint32_t none = isMaskedSlot(args.masked_slots, offset) ? kCompactMasked : kCompactNoOffset;
        args.to.compact_offset[base * args.n_offsets + i] = finite ? packed : none;
    }
}

// Converts a chunk; a block takes 128 anchors, whose values its threads then share.
__global__ void __launch_bounds__(kThreads) uploadKernel(const __grid_constant__ UploadArgs args)
{
    const uint32_t first = blockIdx.x * kThreads, n = min(kThreads, args.chunk.anchor_count - first);
    const size_t base = size_t(args.chunk.anchor_first) + first;
    // steps for the offsets of each anchor: an anchor's offsets are about equally large, so that the largest one gives
    // a step for all
    __shared__ float steps[kThreads][3];
    if (threadIdx.x < n)
        for (int a = 0; a < 3; ++a) {
            float largest = 0.0f;
            const float* offsets = array<float>(args, ChunkArray::Offset, first + threadIdx.x);
            for (uint32_t k = 0; k < args.n_offsets; ++k)
                if (isfinite(offsets[3 * k + a]))
                    largest = fmaxf(largest, fabsf(offsets[3 * k + a]));
            steps[threadIdx.x][a] = largest / float(kOffsetSteps);
        }
    __syncthreads();
    if (threadIdx.x < n) {
        const uint32_t i = first + threadIdx.x;
        const size_t at = base + threadIdx.x;
        float4 p{};
        if (args.grid_positions) {
            const GridPosition g = *array<GridPosition>(args, ChunkArray::Position, i);
            float c[3];
            for (int a = 0; a < 3; ++a)
                c[a] = gridCoordinate(args.chunk.origin[a] + int32_t(g.local[a]), args.level.quantum, args.level.origin,
                                      (g.flags >> a & 1) != 0);
            p = {c[0], c[1], c[2], 0.0f};
        } else {
            const float* c = array<float>(args, ChunkArray::Position, i);
            p = {c[0], c[1], c[2], 0.0f};
        }
        if (args.layout.stride[uint32_t(ChunkArray::ExtraLevel)] != 0)
            p.w = *array<float>(args, ChunkArray::ExtraLevel, i);
        reinterpret_cast<float4*>(args.to.placement)[at] = p;
        const float* log_scale = array<float>(args, ChunkArray::Scale, i);
        float scale[6];
        for (int a = 0; a < 6; ++a)
            scale[a] = expf(log_scale[a]);
        for (int a = 0; a < 3; ++a) {
            args.to.size[at * 3 + a] = scale[a];
            if (args.to.shape != nullptr) {
                args.to.shape[at * 6 + a] = scale[a] * steps[threadIdx.x][a];
                args.to.shape[at * 6 + 3 + a] = scale[3 + a];
            }
        }
        args.to.source[at] = *array<uint32_t>(args, ChunkArray::SourceIndex, i);
        if (args.to.rotation != nullptr)
            for (int a = 0; a < 4; ++a)
                args.to.rotation[at * 4 + a] = array<float>(args, ChunkArray::Rotation, i)[a];
    }
    if (args.to.compact_shape != nullptr)
        packCompact(args, first, n);
    if (args.to.feature != nullptr)
        for (uint32_t i = threadIdx.x; i < n * args.feat_dim; i += kThreads)
            args.to.feature[base * args.feat_dim + i] = halfBits(array<float>(args, ChunkArray::Feature, first)[i]);
    if (args.to.offset != nullptr)
        for (uint32_t i = threadIdx.x; i < n * args.n_offsets; i += kThreads) {
            const float* offset = array<float>(args, ChunkArray::Offset, first) + size_t(3) * i;
            uint64_t packed = 0;
            bool finite = true;
            for (uint32_t a = 0; a < 3; ++a) {
                const float step = steps[i / args.n_offsets][a];
                finite = finite && isfinite(offset[a]);
                const int32_t count = finite && step > 0.0f ? __float2int_rn(offset[a] / step) : 0;
                packed |= uint64_t(min(max(count, -kOffsetSteps), kOffsetSteps) + kOffsetSteps + 1)
                          << (kOffsetBits * a);
            }
            const uint64_t none = isMaskedSlot(args.masked_slots, offset) ? kMaskedSlot : kNoOffset;
            args.to.offset[base * args.n_offsets + i] = finite ? packed : none;
        }
}

} // namespace

void uploadCuda(const UploadArgs& args, CUstream_st* stream)
{
    if (args.chunk.anchor_count == 0)
        return;
    launchCuda(uploadKernel, (args.chunk.anchor_count + kThreads - 1) / kThreads, kThreads, 0, stream, args);
}

int probeCuda()
{
    cudaFuncAttributes attributes{};
    return cudaFuncGetAttributes(&attributes, uploadKernel);
}

} // namespace gsc
