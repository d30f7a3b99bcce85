// SPDX-License-Identifier: Apache-2.0
#include "convert/sample/model/sample_weights.h"

#include "convert/sample/model/hash_random.h"

namespace gsc {

namespace {

constexpr uint32_t F = kSampleFeatures, K = kSampleOffsets;

// Columns of an MLP's first layer: F features, 3 for the direction, then distance, level and appearance if they are
// inputs.
struct Columns {
    uint32_t direction, distance, level, appearance, count;
};

Columns columnsOf(const SampleInputs& inputs, bool appearance)
{
    Columns c{};
    c.direction = F;
    c.distance = c.direction + 3;
    c.level = c.distance + (inputs.distance ? 1 : 0);
    c.appearance = c.level + (inputs.level ? 1 : 0);
    c.count = c.appearance + (appearance ? inputs.appearance : 0);
    return c;
}

Mlp makeMlp(MlpKind kind, Activation activation, const SampleInputs& inputs, uint32_t in, uint32_t hidden, uint32_t out)
{
    Mlp mlp;
    mlp.kind = kind;
    mlp.activation = activation;
    mlp.inputs = kMlpTakesFeature | (inputs.distance ? uint32_t(kMlpTakesDistance) : 0) |
                 (inputs.level ? uint32_t(kMlpTakesLevel) : 0);
    mlp.layers[0] = {in, hidden, std::vector<float>(size_t(in) * hidden), std::vector<float>(hidden)};
    mlp.layers[1] = {hidden, out, std::vector<float>(size_t(hidden) * out), std::vector<float>(out)};
    return mlp;
}

float& weight(Mlp& mlp, int layer, uint32_t out, uint32_t in)
{
    return mlp.layers[layer].weight[size_t(out) * mlp.layers[layer].in + in];
}

// Makes a hidden unit relu(x + limit), which passes on a feature x in [-limit, limit]; connect() subtracts the limit
// again.
void passThrough(Mlp& mlp, uint32_t unit, uint32_t feature, float limit)
{
    weight(mlp, 0, unit, feature) = 1;
    mlp.layers[0].bias[unit] = limit;
}

void connect(Mlp& mlp, uint32_t out, uint32_t unit, float factor, float limit)
{
    weight(mlp, 1, out, unit) += factor;
    mlp.layers[1].bias[out] -= factor * limit;
}

// A number in [-1, 1) that differs from Gaussian to Gaussian and from use to use.
float spread(uint32_t k, uint32_t use)
{
    return float(2 * hashUnit(hashKey(k, use, 0x5eed)) - 1);
}

// Makes six hidden units, each for one side from which an anchor is seen; the more ragged the anchor, the larger their
// values.
void watchSides(Mlp& mlp, uint32_t first, uint32_t direction, float factor)
{
    for (uint32_t side = 0; side < 6; ++side) {
        weight(mlp, 0, first + side, direction + side / 2) = side % 2 ? -factor : factor;
        weight(mlp, 0, first + side, kFeatureRagged) = factor;
        mlp.layers[0].bias[first + side] = -factor;
    }
}

// Sets the weights of a hidden unit for distance and level, as far as the model has these inputs.
void watchDistance(Mlp& mlp, uint32_t unit, const Columns& in, const SampleInputs& inputs, float distance, float level)
{
    if (inputs.distance)
        weight(mlp, 0, unit, in.distance) = distance / inputs.distance_unit;
    if (inputs.level)
        weight(mlp, 0, unit, in.level) = level;
}

Mlp opacityMlp(const SampleInputs& inputs)
{
    const Columns in = columnsOf(inputs, false);
    Mlp mlp = makeMlp(MlpKind::Opacity, Activation::Tanh, inputs, in.count, F, K);
    constexpr float kDead = -1.2f, kAliveStep = 3.1f; // with tanh these become the opacities -0.83 and 0.96
    constexpr uint32_t kBias = 2 * K, kSides = 2 * K + 1;
    for (uint32_t k = 0; k < K; ++k) {
        // two units that differ by a step of height one where kFeatureAlive exceeds k / K
        weight(mlp, 0, 2 * k, kFeatureAlive) = 4 * float(K);
        mlp.layers[0].bias[2 * k] = -4 * (float(k) + 0.25f);
        weight(mlp, 0, 2 * k + 1, kFeatureAlive) = 4 * float(K);
        mlp.layers[0].bias[2 * k + 1] = -4 * (float(k) + 0.25f) - 1;
        mlp.layers[1].bias[k] = kDead;
        weight(mlp, 1, k, 2 * k) = kAliveStep;
        weight(mlp, 1, k, 2 * k + 1) = -kAliveStep;
    }
    passThrough(mlp, kBias, kFeatureOpacity, 1);
    for (uint32_t k = 0; k < K; ++k)
        connect(mlp, k, kBias, 1, 1);
    // makes leaves visible from one side and not from another
    watchSides(mlp, kSides, in.direction, 1.5f);
    for (uint32_t side = 0; side < 6; ++side)
        for (uint32_t k = 0; k < K; ++k)
            weight(mlp, 1, k, kSides + side) = 0.35f * spread(k, side);
    watchDistance(mlp, kBias, in, inputs, 0.02f, 0.01f);
    return mlp;
}

Mlp covarianceMlp(const SampleInputs& inputs)
{
    const Columns in = columnsOf(inputs, false);
    Mlp mlp = makeMlp(MlpKind::Covariance, Activation::None, inputs, in.count, F, 7 * K);
    constexpr uint32_t kRagged = 3, kSides = 4, kLod = 10;
    const float share_logit = std::log(kSizeShare / (1 - kSizeShare));
    for (uint32_t axis = 0; axis < 3; ++axis)
        passThrough(mlp, axis, kFeatureTurn + axis, kTurnLimit);
    weight(mlp, 0, kRagged, kFeatureRagged) = 1;
    watchSides(mlp, kSides, in.direction, 1);
    watchDistance(mlp, kLod, in, inputs, 0.5f, 0.05f);
    for (uint32_t k = 0; k < K; ++k) {
        for (uint32_t axis = 0; axis < 3; ++axis) {
            const uint32_t out = 7 * k + axis;
            mlp.layers[1].bias[out] = share_logit;
            weight(mlp, 1, out, kRagged) = 0.8f * spread(k, 10 + axis) - 0.5f;
            weight(mlp, 1, out, kLod) = 0.1f;
            for (uint32_t side = 0; side < 6; ++side)
                weight(mlp, 1, out, kSides + side) = 0.3f * spread(k, 20 + side);
        }
        mlp.layers[1].bias[7 * k + 3] = 1;
        for (uint32_t axis = 0; axis < 3; ++axis) {
            const uint32_t out = 7 * k + 4 + axis;
            connect(mlp, out, axis, 1, kTurnLimit);
            weight(mlp, 1, out, kRagged) = 0.7f * spread(k, 30 + axis);
        }
    }
    return mlp;
}

Mlp colorMlp(const SampleInputs& inputs, const float water_glint[3])
{
    const Columns in = columnsOf(inputs, true);
    Mlp mlp = makeMlp(MlpKind::Color, Activation::Sigmoid, inputs, in.count, F, 3 * K);
    if (inputs.appearance)
        mlp.inputs |= kMlpTakesAppearance;
    constexpr uint32_t kLight = 3, kHue = kLight + K, kSheen = kHue + K, kGlint = kSheen + 5, kHaze = kGlint + 1;
    for (uint32_t c = 0; c < 3; ++c)
        passThrough(mlp, c, kFeatureBase + c, kBaseLimit);
    for (uint32_t k = 0; k < K; ++k) {
        passThrough(mlp, kLight + k, kFeatureLight + k, kLightLimit);
        passThrough(mlp, kHue + k, kFeatureHue + k, kHueLimit);
    }
    // glass that faces +x mirrors most sky at a grazing view: 1 - |cos| grows as the view direction's x goes from -1 to
    // 0
    constexpr float kGate = 1.8f;
    for (uint32_t i = 0; i < 5; ++i) {
        const uint32_t axis = i / 2;
        const float sign = i % 2 ? -1.0f : 1.0f;
        weight(mlp, 0, kSheen + i, in.direction + axis) = sign;
        weight(mlp, 0, kSheen + i, kFeatureGloss + axis) = sign * kGate;
        mlp.layers[0].bias[kSheen + i] = -1;
    }
    // the sun's reflection on water
    for (uint32_t axis = 0; axis < 3; ++axis)
        weight(mlp, 0, kGlint, in.direction + axis) = 7 * water_glint[axis];
    weight(mlp, 0, kGlint, kFeatureGloss + 2) = 7;
    mlp.layers[0].bias[kGlint] = -13.2f;
    watchDistance(mlp, kHaze, in, inputs, 1, 0.01f);
    // the first two columns of the appearance embedding set exposure and warmth
    for (uint32_t c = 0; inputs.appearance && c < 3; ++c) {
        weight(mlp, 0, c, in.appearance) = 0.8f;
        weight(mlp, 0, c, in.appearance + 1) = -0.6f * kHueAxis[c];
        for (uint32_t a = 2; a < inputs.appearance; ++a)
            weight(mlp, 0, c, in.appearance + a) = 0.02f * spread(a, 40 + c);
    }
    constexpr float kSky[3] = {0.95f, 1.15f, 1.4f}, kSun[3] = {2.4f, 2.1f, 1.6f}, kAir[3] = {0.10f, 0.14f, 0.20f};
    for (uint32_t k = 0; k < K; ++k)
        for (uint32_t c = 0; c < 3; ++c) {
            const uint32_t out = 3 * k + c;
            connect(mlp, out, c, 1, kBaseLimit);
            connect(mlp, out, kLight + k, 1, kLightLimit);
            connect(mlp, out, kHue + k, kHueAxis[c], kHueLimit);
            for (uint32_t i = 0; i < 5; ++i)
                weight(mlp, 1, out, kSheen + i) = 1.7f * kSky[c];
            weight(mlp, 1, out, kGlint) = kSun[c];
            weight(mlp, 1, out, kHaze) = kAir[c];
        }
    return mlp;
}

// Weighs the three resolutions of the feature bank: nearly all from the full one, a little from the coarser ones, more
// where the view is oblique.
Mlp bankMlp(const SampleInputs& inputs)
{
    const uint32_t in = 3 + (inputs.bank_distance || inputs.bank_level ? 1 : 0);
    Mlp mlp = makeMlp(MlpKind::FeatureBank, Activation::Softmax, inputs, in, F, 3);
    mlp.inputs =
        (inputs.bank_distance ? uint32_t(kMlpTakesDistance) : 0) | (inputs.bank_level ? uint32_t(kMlpTakesLevel) : 0);
    for (uint32_t side = 0; side < 6; ++side) {
        weight(mlp, 0, side, side / 2) = side % 2 ? -1.0f : 1.0f;
        weight(mlp, 1, 0, side) = 0.25f * spread(side, 50);
        weight(mlp, 1, 1, side) = 0.25f * spread(side, 51);
    }
    if (in > 3) {
        weight(mlp, 0, 6, 3) = inputs.bank_distance ? 0.1f / inputs.distance_unit : 0.05f;
        weight(mlp, 1, 0, 6) = 0.2f;
    }
    mlp.layers[1].bias = {-3.2f, -2.6f, 3.0f};
    return mlp;
}

} // namespace

std::vector<Mlp> sampleMlps(const SampleInputs& inputs, const float water_glint[3])
{
    std::vector<Mlp> mlps = {opacityMlp(inputs), covarianceMlp(inputs), colorMlp(inputs, water_glint)};
    if (inputs.feature_bank)
        mlps.push_back(bankMlp(inputs));
    return mlps;
}

std::vector<float> sampleEmbedding(uint32_t rows, uint64_t seed)
{
    std::vector<float> values(size_t(rows) * kSampleAppearance);
    for (uint32_t row = 0; row < rows; ++row) {
        HashRandom random(hashKey(seed, row, 0xa99ea7));
        float* e = &values[size_t(row) * kSampleAppearance];
        for (uint32_t i = 0; i < kSampleAppearance; ++i)
            e[i] = float(random.between(-0.3, 0.3));
        const double hour = rows > 1 ? double(row) / (rows - 1) : 0.5; // 0.5 = noon; rows go from morning to evening
        e[0] += float(0.3 - 1.2 * (hour - 0.5) * (hour - 0.5));
        e[1] += float(1.6 * (hour - 0.5) * (hour - 0.5));
    }
    return values;
}

} // namespace gsc
