// SPDX-License-Identifier: Apache-2.0
// The networks on the matrix units, as one warp computes them for 16 rows (decode_fragments.h).
#pragma once

#include "kernels/cuda/halves.cuh"
#include "kernels/cuda/ptx.cuh"
#include "kernels/decode/decode_fragments.h"

namespace gsc {

__device__ __forceinline__ float sigmoidFast(float v)
{
    return __fdividef(1.0f, 1.0f + __expf(-v));
}

// note: 1 - 2 / (e^2v + 1) loses relative precision near zero, where the opacity is below 1/255 and dropped anyway
__device__ __forceinline__ float tanhFast(float v)
{
    return 1.0f - __fdividef(2.0f, __expf(2.0f * v) + 1.0f);
}

// A operand of the view tile: lane 0 of a row holds the high parts of the direction, lane 1 the low parts, lane 2
// distance and level, lane 3 ones.
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

// Softmax weights of the feature bank for one anchor and eye. The four lanes of its row share the hidden units.
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
        h = h < 0.0f ? 0.0f : h; // NaN stays
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

// The features of row r after the bank: feature j becomes w0 f[4 (j mod 8)] + w1 f[2 (j mod 16)] + w2 f[j]. A lane holds
// features 8 t to 8 t + 7, two to a word, and gets the others from the lanes of its row.
__device__ __forceinline__ void bankedFeatures(const uint32_t (&feature)[2][4], uint32_t r, const float (&w)[3],
                                               uint32_t lane, uint32_t (&out)[2][4])
{
    const uint32_t own[4] = {feature[0][r], feature[0][2 + r], feature[1][r], feature[1][2 + r]};
    const uint32_t row = lane & ~3u, half = row + (lane & 1u) * 2;
#pragma unroll
    for (uint32_t word = 0; word < 4; ++word) {
        // values 2 word and 2 word + 1 of this lane's eight: of every fourth feature they are in lane `word` of the row,
        // of every second one in the words 2 word and 2 word + 1 of two lanes
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

// Weights in shared memory.
struct DecodeNetworks {
    uint4 pairs[kPairTiles * 32];
    uint2 views[kFirstTiles * 32];
    float4 biases[kSecondTiles * 4]; // of the second layers, as a lane's accumulators begin with them
    alignas(16) float bank[kBankValues];
};

// d += a b over the two k tiles of a pair.
__device__ __forceinline__ void multiplyPair(float* d, const uint32_t (*a)[4], const uint4& b)
{
    mmaM16N8K16(d, a[0], {b.x, b.y});
    mmaM16N8K16(d, a[1], {b.z, b.w});
}

// A tile of the second layers: `hidden` are the A operands of its head's two k tiles.
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

// Value v of a lane's list, for row r of the pair.
template <uint32_t kTiles>
__device__ __forceinline__ float value(const float (&out)[kTiles][4], uint32_t v, uint32_t r)
{
    return out[v >> 1][(v & 1u) + 2 * r];
}

} // namespace gsc
