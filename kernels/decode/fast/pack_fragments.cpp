// SPDX-License-Identifier: Apache-2.0
// Packs the weights for the decoder on matrix units, on the host, in the order of its fragments.
#include "kernels/decode/fast/decode_fast_cuda.h"

#include <gsc/half.h>
#include "kernels/decode/fast/fragments.h"
#include "kernels/math/mlp.h"

#include <algorithm>
#include <cmath>

namespace gsc {

namespace {

constexpr uint32_t kHidden = 32; // hidden units of a head

// Bits of the half float nearest to `value`; the largest finite one for larger values, zero for NaN.
uint16_t halfBits(float value)
{
    return floatToHalf(value == value ? std::clamp(value, -65504.0f, 65504.0f) : 0.0f);
}

// Input that slot s of lane t in the view tile multiplies, counted from the end of the features; -1: zero. Lanes 0 and
// 1 hold the high and low parts of the direction, lane 2 those of the distance, and the level, lane 3 ones for the two
// parts of the bias.
constexpr int kDistanceInput = 3, kBiasHigh = 5, kBiasLow = 6;
constexpr int kViewInput[4][4] = {
    {0, 1, 2, -1}, {0, 1, 2, -1}, {kDistanceInput, kDistanceInput, 4, -1}, {kBiasHigh, kBiasLow, -1, -1}};

std::vector<float> packBank(const ModelView& model, const MlpRecord& bank)
{
    const float *weight0 = mlpWeights(model, bank.weight0), *bias0 = mlpWeights(model, bank.bias0);
    const float *weight1 = mlpWeights(model, bank.weight1), *bias1 = mlpWeights(model, bank.bias1);
    std::vector<float> values(kBankValues, 0.0f);
    for (uint32_t u = 0; u < kBankUnits; ++u) {
        float* unit = values.data() + size_t(u) * kBankStride;
        const float* row = weight0 + size_t(u) * bank.in;
        std::copy_n(row, 3, unit);
        uint32_t next = 3;
        if (bank.inputs & kMlpTakesDistance)
            unit[3] = row[next++];
        if (bank.inputs & kMlpTakesLevel)
            unit[4] = row[next];
        unit[5] = bias0[u];
        for (uint32_t o = 0; o < 3; ++o)
            unit[6 + o] = weight1[size_t(o) * kBankUnits + u];
    }
    std::copy_n(bias1, 3, values.data() + kBankUnits * kBankStride);
    return values;
}

} // namespace

bool canDecodeFast(const ModelView& model)
{
    // the number of features is also that of the hidden units of all networks
    return model.params->feat_dim == kFastFeatures && model.params->n_offsets <= 4 * kItemsPerLane;
}

DecodeWeights packFragments(const ModelView& model, int32_t appearance)
{
    const ModelParams& params = *model.params;
    const uint32_t F = params.feat_dim, K = params.n_offsets;
    const PackedMlpHeader& header = *reinterpret_cast<const PackedMlpHeader*>(model.packed);
    // the heads lie side by side with no padding between them, since each has kHidden units
    const float* first = packedWeights(model, header.first_f32);
    const auto firstWeight = [first](uint32_t row, uint32_t column) {
        return first[size_t(row) * 3 * kHidden + column];
    };

    DecodeWeights out;
    out.fragments.assign(size_t(kFragmentTiles) * kTileHalves, 0);
    out.biases.assign(kBiasCount, 0.0f);

    // biases, each of which is packed as a half float and a second one for what remains
    std::vector<float> first_bias(8 * kFirstTiles);
    for (uint32_t column = 0; column < first_bias.size(); ++column) {
        float& bias = first_bias[column];
        bias = packedWeights(model, header.first_bias_f32)[column];
        if (params.appearance_dim != 0 && appearance >= 0)
            for (uint32_t a = 0; a < params.appearance_dim; ++a)
                bias +=
                    firstWeight(F + 5 + a, column) * model.embedding[size_t(appearance) * params.appearance_dim + a];
    }
    const auto viewWeight = [&](int input, uint32_t column) {
        const float bias = first_bias[column];
        if (input < 0)
            return halfBits(0);
        if (bias != bias && (input == kBiasHigh || input == kBiasLow))
            return floatToHalf(bias); // a NaN stays NaN
        if (input == kBiasHigh)
            return halfBits(bias);
        if (input == kBiasLow)
            return halfBits(bias - halfToFloat(halfBits(bias)));
        return halfBits(firstWeight(F + uint32_t(input), column) * (input == kDistanceInput ? kDistanceScale : 1.0f));
    };

    // first of the half floats of a lane in k tile kt of a pair
    const auto ofPair = [&](uint32_t pair, uint32_t kt, uint32_t lane) {
        return out.fragments.data() + ((size_t(pair) * 32 + lane) * 2 + kt) * 4;
    };
    // B fragment of mma.m16n8k16: lane 4 * column + t holds rows {2t, 2t+1, 2t+8, 2t+9}; which input a row means is
    // free to choose
    for (uint32_t kt = 0; kt < 3; ++kt)
        for (uint32_t nt = 0; nt < kFirstTiles; ++nt)
            for (uint32_t lane = 0; lane < 32; ++lane)
                for (uint32_t s = 0; s < 4; ++s) {
                    const uint32_t t = lane & 3u, column = nt * 8 + (lane >> 2);
                    uint16_t* const to =
                        kt < 2 ? ofPair(nt, kt, lane) : &out.fragments[(size_t(2 * kPairTiles + nt) * 32 + lane) * 4];
                    to[s] = kt < 2 ? halfBits(firstWeight(8 * t + 4 * kt + s, column))
                                   : viewWeight(kViewInput[t][s], column);
                }

    // second layers: pairs of columns are dealt out so that each lane gets all outputs of its Gaussians
    const uint32_t tiles[3] = {kOpacityTiles, kCovarianceTiles, kColorTiles};
    const uint32_t width[3] = {1, 7, 3};
    uint32_t tile = 0;
    for (uint32_t head = 0; head < 3; ++head) {
        const float* weight = packedWeights(model, header.second_f32[head]);
        const float* bias = packedWeights(model, header.second_bias_f32[head]);
        for (uint32_t nt = 0; nt < tiles[head]; ++nt)
            for (uint32_t column = 0; column < 8; ++column) {
                const uint32_t value = 2 * nt + (column & 1u), item = value / width[head], part = value % width[head];
                const uint32_t k = (column >> 1) + 4 * item;
                const bool used = item < kItemsPerLane && k < K;
                const uint32_t output = k * width[head] + part;
                if (used)
                    out.biases[size_t(tile + nt) * 8 + column] = bias[output];
                for (uint32_t kt = 0; kt < 2; ++kt)
                    for (uint32_t t = 0; t < 4; ++t)
                        for (uint32_t s = 0; s < 4; ++s) {
                            const uint32_t row = 16 * kt + 2 * t + (s & 1u) + 8 * (s >> 1);
                            const float w = used ? weight[size_t(row) * header.out_pad[head] + output] : 0.0f;
                            ofPair(kFirstTiles + tile + nt, kt, 4 * column + t)[s] = halfBits(w);
                        }
            }
        tile += tiles[head];
    }
    if (const MlpRecord* bank = mlpRecord(model, MlpKind::FeatureBank))
        out.bank = packBank(model, *bank);
    return out;
}

} // namespace gsc
