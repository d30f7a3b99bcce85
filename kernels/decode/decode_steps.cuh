// SPDX-License-Identifier: Apache-2.0
// What one warp does to decode 16 anchors from one place: gather, first layer, second layers into a staging. Both
// decoders of the tier `fast` are made of it (decode.cu, decode_keep.cu).
#pragma once

#include "kernels/decode/decode_emit.cuh"

namespace gsc {

// Weights in shared memory.
struct DecodeNetworks {
    uint2 fragments[kFragmentTiles * 32];
    float biases[kBiasCount];
    alignas(16) float bank[kBankValues];
};

constexpr uint32_t kDecodeThreads = 256;
constexpr uint32_t kDecodeWarps = kDecodeThreads / 32;
constexpr uint32_t kDecodeBlocks = 2; // per multiprocessor

struct DecodeShared {
    DecodeNetworks networks;
    Staging staging[kDecodeWarps];
};
static_assert(sizeof(DecodeShared) <= 99 * 1024); // what a block can have on compute capability 8.6, 8.9 and 12.0

// All threads of the block call it together.
template <bool kBank>
__device__ __forceinline__ void loadNetworks(const DecodeCudaArgs& args, DecodeNetworks& networks)
{
    for (uint32_t i = threadIdx.x; i < kFragmentTiles * 32; i += kDecodeThreads)
        networks.fragments[i] = static_cast<const uint2*>(args.fragments)[i];
    for (uint32_t i = threadIdx.x; i < kBiasCount; i += kDecodeThreads)
        networks.biases[i] = args.biases[i];
    if constexpr (kBank)
        for (uint32_t i = threadIdx.x; i < kBankValues; i += kDecodeThreads)
            networks.bank[i] = args.bank[i];
    __syncthreads();
}

// Features 8t to 8t + 7 of an anchor, as halves.
template <bool kCompact>
__device__ __forceinline__ uint4 featuresOf(const DeviceModel& model, size_t anchor, uint32_t t)
{
    if constexpr (!kCompact)
        return reinterpret_cast<const uint4*>(model.feature)[anchor * 4 + t];
    const uint2 steps = reinterpret_cast<const uint2*>(model.compact_feature)[anchor * 4 + t];
    const float power_of_two = powerOfTwo(model.compact_shape[anchor].feature_power);
    const __half2 power = __floats2half2_rn(power_of_two, power_of_two);
    const __half2 nothing = __floats2half2_rn(1152.0f, 1152.0f); // 1024 and the 128 that all are more
    const auto halves = [power, nothing](uint32_t bytes, uint32_t which) {
        // a byte below 0x64 is the half of 1024 more than it
        const uint32_t counted = __byte_perm(bytes, 0x64646464u, which);
        const __half2 value = __hmul2(__hsub2(reinterpret_cast<const __half2&>(counted), nothing), power);
        return reinterpret_cast<const uint32_t&>(value);
    };
    return {halves(steps.x, 0x4140u), halves(steps.x, 0x4342u), halves(steps.y, 0x4140u), halves(steps.y, 0x4342u)};
}

// Features and levels of a lane's two anchors, the features as operands: per k tile.
template <bool kCompact>
__device__ __forceinline__ void gatherInputs(const DecodeCudaArgs& args, const uint32_t (&anchors)[2], uint32_t t,
                                             uint32_t (&feature)[2][4], float (&levels)[2])
{
    const DeviceModel& model = args.model;
#pragma unroll
    for (uint32_t r = 0; r < 2; ++r) {
        const uint4 f = featuresOf<kCompact>(model, anchors[r], t);
        feature[0][r] = f.x;
        feature[0][2 + r] = f.y;
        feature[1][r] = f.z;
        feature[1][2 + r] = f.w;
    }
    levels[0] = levels[1] = 0.0f;
    if (args.takes_level)
        for (uint32_t l = 0; l < model.params.level_count; ++l)
#pragma unroll
            for (uint32_t r = 0; r < 2; ++r)
                if (anchors[r] >= model.level_first[l])
                    levels[r] = float(model.levels[l].level);
}

// Hidden units of all heads seen from `center`, as operands of the second layers, two k tiles per head.
template <bool kBank>
__device__ __forceinline__ void
firstLayer(const DecodeCudaArgs& args, const DecodeNetworks& networks, uint32_t lane, const float (&positions)[2][3],
           const float* center, const uint32_t (&feature)[2][4], const float (&levels)[2], uint32_t (&hidden)[6][4])
{
    const uint32_t t = lane & 3u;
    const uint2* fragments = networks.fragments;
    const float* biases = networks.biases;
    uint32_t view[4], inputs[2][4]; // inputs: the features, after the bank
#pragma unroll
    for (uint32_t r = 0; r < 2; ++r) {
        float u[3];
        for (int i = 0; i < 3; ++i)
            u[i] = positions[r][i] - center[i];
        const float distance = sqrtf(u[0] * u[0] + u[1] * u[1] + u[2] * u[2]);
        const float inverse = __fdividef(1.0f, distance);
        for (int i = 0; i < 3; ++i)
            u[i] *= inverse;
        viewOperand(t, u, args.takes_distance ? distance : 0.0f, levels[r], view[r], view[2 + r]);
        if constexpr (kBank) {
            float weights[3];
            bankWeights(networks.bank, t, u, distance, levels[r], weights);
            bankedFeatures(feature, r, weights, lane, inputs);
        }
    }
    if constexpr (!kBank)
#pragma unroll
        for (uint32_t i = 0; i < 8; ++i)
            inputs[i / 4][i % 4] = feature[i / 4][i % 4];
#pragma unroll
    for (uint32_t nt = 0; nt < kFirstTiles; ++nt) {
        const float2 bias = *reinterpret_cast<const float2*>(biases + nt * 8 + 2 * t);
        float d[4] = {bias.x, bias.y, bias.x, bias.y};
        mmaM16N8K16(d, inputs[0], fragments[nt * 32 + lane]);
        mmaM16N8K16(d, inputs[1], fragments[(kFirstTiles + nt) * 32 + lane]);
        mmaM16N8K16(d, view, fragments[(2 * kFirstTiles + nt) * 32 + lane]);
        hidden[nt / 2][(nt & 1u) * 2] = halvesRelu(d[0], d[1]);
        hidden[nt / 2][(nt & 1u) * 2 + 1] = halvesRelu(d[2], d[3]);
    }
}

// Where the Gaussians that this lane keeps go in the staging: slot-major over the warp, so that neighbours share an
// anchor. keep: bit 3 r + item. Returns their number over the warp.
__device__ __forceinline__ uint32_t stagingIndices(uint32_t keep, uint32_t lane, uint32_t (&index)[2 * kItemsPerLane])
{
    uint32_t total = 0;
#pragma unroll
    for (uint32_t slot = 0; slot < 2 * kItemsPerLane; ++slot) {
        const uint32_t mask = __ballot_sync(~0u, (keep >> slot & 1u) != 0);
        index[slot] = total + __popc(mask & ((1u << lane) - 1u));
        total += __popc(mask);
    }
    return total;
}

// Opacities before their activation.
__device__ __forceinline__ void opacityLayer(const DecodeNetworks& networks, uint32_t lane,
                                             const uint32_t (&hidden)[6][4], float (&opacity)[kOpacityTiles][4])
{
    secondLayer<kOpacityTiles>(networks.fragments + 3 * kFirstTiles * 32, networks.biases + 8 * kFirstTiles, lane,
                               hidden, opacity);
}

// Shapes and colours of the Gaussians kept.
__device__ __forceinline__ void stageShapes(const DecodeNetworks& networks, uint32_t lane,
                                            const uint32_t (&hidden)[6][4], uint32_t keep,
                                            const uint32_t (&at)[2 * kItemsPerLane], Staging& staged)
{
    const uint2* second = networks.fragments + 3 * kFirstTiles * 32;
    const float* bias2 = networks.biases + 8 * kFirstTiles;
    {
        float covariance[kCovarianceTiles][4];
        secondLayer<kCovarianceTiles>(second + 2 * kOpacityTiles * 32, bias2 + 8 * kOpacityTiles, lane, hidden + 2,
                                      covariance);
#pragma unroll
        for (uint32_t r = 0; r < 2; ++r)
#pragma unroll
            for (uint32_t item = 0; item < kItemsPerLane; ++item)
                if (keep >> (kItemsPerLane * r + item) & 1u) {
                    const uint32_t i = at[kItemsPerLane * r + item];
#pragma unroll
                    for (uint32_t c = 0; c < 3; ++c)
                        staged.scale[c][i] = value(covariance, 7 * item + c, r);
#pragma unroll
                    for (uint32_t c = 0; c < 4; ++c)
                        staged.rotation[c][i] = value(covariance, 7 * item + 3 + c, r);
                }
    }
    {
        float color[kColorTiles][4];
        secondLayer<kColorTiles>(second + 2 * (kOpacityTiles + kCovarianceTiles) * 32,
                                 bias2 + 8 * (kOpacityTiles + kCovarianceTiles), lane, hidden + 4, color);
#pragma unroll
        for (uint32_t r = 0; r < 2; ++r)
#pragma unroll
            for (uint32_t item = 0; item < kItemsPerLane; ++item)
                if (keep >> (kItemsPerLane * r + item) & 1u)
#pragma unroll
                    for (uint32_t c = 0; c < 3; ++c)
                        staged.color[c][at[kItemsPerLane * r + item]] = value(color, 3 * item + c, r);
    }
}

// Which anchors the rows of a step are. All lanes of the warp call it; what is staged is read after a barrier.
__device__ __forceinline__ void stageAnchors(const uint32_t (&anchors)[2], uint32_t lane, Staging& staged)
{
    if ((lane & 3u) == 0)
        for (uint32_t r = 0; r < 2; ++r)
            staged.anchors[(lane >> 2) + 8 * r] = anchors[r];
}

// emitStaged() for one of the two eyes that a warp counts for.
template <bool kCompact, bool kShared, bool kThins>
__device__ __forceinline__ void emitForEye(const DecodeCudaArgs& args, uint32_t e, Staging& staged, uint32_t count,
                                           const Turns& turns, const uint32_t (&seen_by)[2], const float (&factors)[2],
                                           uint32_t lane, EyeTally& left, EyeTally& right)
{
    EyeTally tally = e == 0 ? left : right;
    if (kShared) // eyes that share their bins take the slots of both from the first one's
        tally.writer = left.writer;
    emitStaged<kCompact, kShared, kThins>(args, e, staged, count, turns, seen_by, factors, lane, tally);
    if (kShared)
        left.writer = tally.writer;
    if (e == 0)
        left = tally;
    else
        right = tally;
}

} // namespace gsc
