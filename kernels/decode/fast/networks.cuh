// SPDX-License-Identifier: Apache-2.0
// Computes the networks on the matrix units: gather, first layer, second layers. One warp does so for 16 rows
// (fragments.h). Both decoders of the tier `fast` use it (decode_kernel.cuh, kernels/reuse/decode_keep.cu).
#pragma once

#include "kernels/cuda/halves.cuh"
#include "kernels/cuda/ptx.cuh"
#include "kernels/decode/fast/decode_fast_cuda.h"
#include "kernels/decode/fast/fragments.h"

namespace gsc {

__device__ __forceinline__ float sigmoidFast(float v)
{
    return __fdividef(1.0f, 1.0f + __expf(-v));
}

// note: 1 - 2 / (e^2v + 1) loses relative precision near zero, where the opacity is below 1/255 and nothing is drawn
__device__ __forceinline__ float tanhFast(float v)
{
    return 1.0f - __fdividef(2.0f, __expf(2.0f * v) + 1.0f);
}

// A operand of the view tile for one lane of a row: lane 0 holds the high parts of the direction, lane 1 the low parts,
// lane 2 distance and level, lane 3 ones.
__device__ __forceinline__ void viewOperand(uint32_t t, const float* u, float distance, float level, uint32_t& low,
                                            uint32_t& high)
{
    float v[4] = {u[0], u[1], u[2], 0.0f};
    if (t == 1) {
        for (int i = 0; i < 3; ++i)
            v[i] = u[i] - __half2float(__float2half_rn(u[i]));
    } else if (t == 2) {
        const float d = fminf(distance * (1.0f / kDistanceScale), 65504.0f);
        v[0] = d;
        v[1] = d - __half2float(__float2half_rn(d));
        v[2] = level;
    } else if (t == 3) {
        v[0] = v[1] = 1.0f;
        v[2] = 0.0f;
    }
    low = packHalves(v[0], v[1]);
    high = packHalves(v[2], v[3]);
}

// Softmax weights of the feature bank for one anchor and eye. The four lanes of the row share the work on hidden units.
__device__ __forceinline__ void bankWeights(const float* bank, uint32_t t, const float* direction, float distance,
                                            float level, float (&weights)[3])
{
    float sum[3] = {0.0f, 0.0f, 0.0f};
#pragma unroll 2
    for (uint32_t u = t; u < kBankUnits; u += 4) {
        const float4* unit = reinterpret_cast<const float4*>(bank + u * kBankStride);
        const float4 a = unit[0], b = unit[1];
        float h = fmaf(a.x, direction[0], fmaf(a.y, direction[1], fmaf(a.z, direction[2], b.y)));
        h = fmaf(a.w, distance, fmaf(b.x, level, h));
        h = h < 0.0f ? 0.0f : h; // a ReLU that keeps NaN
        sum[0] = fmaf(b.z, h, sum[0]);
        sum[1] = fmaf(b.w, h, sum[1]);
        sum[2] = fmaf(bank[u * kBankStride + 8], h, sum[2]);
    }
#pragma unroll
    for (uint32_t i = 0; i < 3; ++i) {
        sum[i] += __shfl_xor_sync(~0u, sum[i], 1);
        sum[i] += __shfl_xor_sync(~0u, sum[i], 2);
        sum[i] += bank[kBankUnits * kBankStride + i];
    }
    const float top = fmaxf(sum[0], fmaxf(sum[1], sum[2]));
    float total = 0.0f;
#pragma unroll
    for (uint32_t i = 0; i < 3; ++i) {
        weights[i] = __expf(sum[i] - top);
        total += weights[i];
    }
    const float inverse = __fdividef(1.0f, total);
#pragma unroll
    for (uint32_t i = 0; i < 3; ++i)
        weights[i] *= inverse;
}

// Passes the features of row r through the feature bank: feature j becomes w0 f[4 (j mod 8)] + w1 f[2 (j mod 16)] + w2
// f[j]. A lane holds features 8 t to 8 t + 7, two in a word, and gets the others from the lanes of the row.
__device__ __forceinline__ void bankedFeatures(const uint32_t (&feature)[2][4], uint32_t r, const float (&w)[3],
                                               uint32_t lane, uint32_t (&out)[2][4])
{
    const uint32_t own[4] = {feature[0][r], feature[0][2 + r], feature[1][r], feature[1][2 + r]};
    const uint32_t row = lane & ~3u, half = row + (lane & 1u) * 2;
#pragma unroll
    for (uint32_t word = 0; word < 4; ++word) {
        // loads what values 2 word and 2 word + 1 of this lane need: lane `word` of the row holds every fourth feature
        // for them, the words 2 word and 2 word + 1 of two lanes every second one
        const float fourth[2] = {halvesOf(__shfl_sync(~0u, own[0], row + word)).x,
                                 halvesOf(__shfl_sync(~0u, own[2], row + word)).x};
        const uint32_t from = half + word / 2;
        const float second[2] = {halvesOf(__shfl_sync(~0u, own[word % 2 * 2], from)).x,
                                 halvesOf(__shfl_sync(~0u, own[word % 2 * 2 + 1], from)).x};
        const float2 mine = halvesOf(own[word]);
        out[word / 2][word % 2 * 2 + r] = packHalves(fmaf(w[0], fourth[0], fmaf(w[1], second[0], w[2] * mine.x)),
                                                     fmaf(w[0], fourth[1], fmaf(w[1], second[1], w[2] * mine.y)));
    }
}

// Weights of the networks in shared memory.
struct DecodeNetworks {
    uint4 pairs[kPairTiles * 32];
    uint2 views[kFirstTiles * 32];
    float4 biases[kSecondTiles * 4]; // biases of the second layers, in the layout with which a lane's sums start
    alignas(16) float bank[kBankValues];
};

// Computes d += a b over the two k tiles of a pair.
__device__ __forceinline__ void multiplyPair(float* d, const uint32_t (*a)[4], const uint4& b)
{
    mmaM16N8K16(d, a[0], {b.x, b.y});
    mmaM16N8K16(d, a[1], {b.z, b.w});
}

// Computes a tile of the second layers; `hidden` has the A operands of the two k tiles of the tile's head.
__device__ __forceinline__ void secondLayerTile(const DecodeNetworks& networks, uint32_t tile, uint32_t lane,
                                                const uint32_t (*hidden)[4], float* out)
{
    const float4 bias = networks.biases[tile * 4 + (lane & 3u)];
    out[0] = bias.x;
    out[1] = bias.y;
    out[2] = bias.z;
    out[3] = bias.w;
    multiplyPair(out, hidden, networks.pairs[(kFirstTiles + tile) * 32 + lane]);
}

// Value number v of those that a lane has in a head's tiles, for row r (0 or 1) of the lane's pair of rows.
template <uint32_t kTiles>
__device__ __forceinline__ float value(const float (&out)[kTiles][4], uint32_t v, uint32_t r)
{
    return out[v >> 1][(v & 1u) + 2 * r];
}

// Loads the weights into shared memory. All threads of the block call it together.
template <bool kBank>
__device__ __forceinline__ void loadNetworks(const DecodeCudaArgs& args, DecodeNetworks& networks)
{
    const uint4* const pairs = static_cast<const uint4*>(args.fragments);
    const uint2* const views = reinterpret_cast<const uint2*>(pairs + kPairTiles * 32);
    for (uint32_t i = threadIdx.x; i < kPairTiles * 32; i += blockDim.x)
        networks.pairs[i] = pairs[i];
    for (uint32_t i = threadIdx.x; i < kFirstTiles * 32; i += blockDim.x)
        networks.views[i] = views[i];
    for (uint32_t i = threadIdx.x; i < kBiasCount / 2; i += blockDim.x) {
        const float2 bias = reinterpret_cast<const float2*>(args.biases)[i];
        networks.biases[i] = {bias.x, bias.y, bias.x, bias.y};
    }
    if constexpr (kBank)
        for (uint32_t i = threadIdx.x; i < kBankValues; i += blockDim.x)
            networks.bank[i] = args.bank[i];
    __syncthreads();
}

// Features 8 t to 8 t + 7 of an anchor, as half floats.
template <bool kCompact>
__device__ __forceinline__ uint4 featuresOf(const DeviceModel& model, size_t anchor, uint32_t t)
{
    if constexpr (!kCompact)
        return reinterpret_cast<const uint4*>(model.feature)[anchor * 4 + t];
    const uint2 steps = reinterpret_cast<const uint2*>(model.compact_feature)[anchor * 4 + t];
    const float power_of_two = powerOfTwo(model.compact_shape[anchor].feature_power);
    const __half2 power = __floats2half2_rn(power_of_two, power_of_two);
    // 1024, which the bit pattern adds, and the 128 that is added to each stored step
    const __half2 nothing = __floats2half2_rn(1152.0f, 1152.0f);
    const auto halves = [power, nothing](uint32_t bytes, uint32_t which) {
        // a byte with 0x64 above it is the half float of 1024 + the byte
        const uint32_t counted = __byte_perm(bytes, 0x64646464u, which);
        const __half2 value = __hmul2(__hsub2(reinterpret_cast<const __half2&>(counted), nothing), power);
        return reinterpret_cast<const uint32_t&>(value);
    };
    return {halves(steps.x, 0x4140u), halves(steps.x, 0x4342u), halves(steps.y, 0x4140u), halves(steps.y, 0x4342u)};
}

// Loads features and levels for the two rows of a lane, the features as operands for each k tile.
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

// Computes the hidden units of all heads, each row of the lane seen from one of `centers`, as operands of the second
// layers: two k tiles for each head.
template <bool kBank>
__device__ __forceinline__ void firstLayer(const DecodeCudaArgs& args, const DecodeNetworks& networks, uint32_t lane,
                                           const float (&positions)[2][3], const float* const (&centers)[2],
                                           const uint32_t (&feature)[2][4], const float (&levels)[2],
                                           uint32_t (&hidden)[6][4])
{
    const uint32_t t = lane & 3u;
    uint32_t view[4], inputs[2][4]; // inputs: features, behind the feature bank if there is one
#pragma unroll
    for (uint32_t r = 0; r < 2; ++r) {
        float u[3];
        for (int i = 0; i < 3; ++i)
            u[i] = positions[r][i] - centers[r][i];
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
        float d[4] = {}; // starts at zero, since the view tile adds the bias
        multiplyPair(d, inputs, networks.pairs[nt * 32 + lane]);
        mmaM16N8K16(d, view, networks.views[nt * 32 + lane]);
        hidden[nt / 2][(nt & 1u) * 2] = halvesRelu(d[0], d[1]);
        hidden[nt / 2][(nt & 1u) * 2 + 1] = halvesRelu(d[2], d[3]);
    }
}

// Finds the rank of each Gaussian of this lane among those that the warp keeps, slot by slot, so that neighbours in
// rank come from neighbouring anchors. keep: a bit for each slot of the lane. Returns the number of Gaussians that the
// warp keeps.
template <uint32_t kSlots>
__device__ __forceinline__ uint32_t stagingIndices(uint32_t keep, uint32_t lane, uint32_t (&index)[kSlots])
{
    uint32_t total = 0;
#pragma unroll
    for (uint32_t slot = 0; slot < kSlots; ++slot) {
        const uint32_t mask = __ballot_sync(~0u, (keep >> slot & 1u) != 0);
        index[slot] = total + __popc(mask & ((1u << lane) - 1u));
        total += __popc(mask);
    }
    return total;
}

// Computes the opacities of a lane's Gaussians.
__device__ __forceinline__ void opacityLayer(const DecodeNetworks& networks, uint32_t lane,
                                             const uint32_t (&hidden)[6][4], float (&opacity)[kOpacityTiles][4])
{
#pragma unroll
    for (uint32_t nt = 0; nt < kOpacityTiles; ++nt)
        secondLayerTile(networks, nt, lane, hidden, opacity[nt]);
#pragma unroll
    for (auto& tile : opacity)
#pragma unroll
        for (float& o : tile)
            o = tanhFast(o);
}

// Computes the outputs of a head, kPer for each Gaussian, and calls put(r, item, which, value) for those of each row
// and Gaussian of this lane; `which` is counted from kWhich. Does a few tiles at a time, since registers are short.
template <uint32_t kFirst, uint32_t kTiles, uint32_t kPer, uint32_t kWhich, typename Put>
__device__ __forceinline__ void putHead(const DecodeNetworks& networks, uint32_t lane, const uint32_t (*hidden)[4],
                                        Put put)
{
    constexpr uint32_t kAtOnce = 6;
#pragma unroll
    for (uint32_t first = 0; first < kTiles; first += kAtOnce) {
        float out[kAtOnce][4];
#pragma unroll
        for (uint32_t i = 0; i < kAtOnce && first + i < kTiles; ++i)
            secondLayerTile(networks, kFirst + first + i, lane, hidden, out[i]);
#pragma unroll
        for (uint32_t r = 0; r < 2; ++r)
#pragma unroll
            for (uint32_t i = 0; i < 2 * kAtOnce; ++i) {
                const uint32_t v = 2 * first + i, item = v / kPer;
                if (v < 2 * kTiles && item < kItemsPerLane)
                    put(r, item, kWhich + v % kPer, value(out, i, r));
            }
    }
}

// Computes shapes and colours; put() gets `which` as emitGaussian() numbers outputs.
template <typename Put>
__device__ __forceinline__ void shapeLayers(const DecodeNetworks& networks, uint32_t lane,
                                            const uint32_t (&hidden)[6][4], Put put)
{
    putHead<kOpacityTiles, kCovarianceTiles, 7, 0>(networks, lane, hidden + 2, put);
    putHead<kOpacityTiles + kCovarianceTiles, kColorTiles, 3, 7>(networks, lane, hidden + 4, put);
}

} // namespace gsc
