// SPDX-License-Identifier: Apache-2.0
// Random anchors, networks and cameras.
#include "tests/kernels/synthetic_model.h"

#include "format/numbers/compact.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <random>
#include <span>

namespace gsc::test {

struct Random::State {
    std::mt19937 engine;
};

Random::Random(uint32_t seed) : m_state(std::make_unique<State>(State{std::mt19937(seed)})) {}
Random::~Random() = default;

float Random::uniform()
{
    return float(m_state->engine() >> 8) * 0x1p-24f;
}

float Random::normal()
{
    float sum = -6;
    for (int i = 0; i < 12; ++i)
        sum += uniform();
    return sum;
}

SyntheticAnchors randomAnchors(const SyntheticOptions& options)
{
    Random random(options.seed);
    SyntheticAnchors anchors;
    const uint32_t K = options.n_offsets, F = options.feat_dim;
    for (uint32_t i = 0; i < options.anchors; ++i) {
        for (int c = 0; c < 3; ++c)
            anchors.position.push_back(random.uniform(-options.extent, options.extent));
        anchors.level.push_back(int32_t(random.uniform() * float(options.levels)));
        anchors.extra_level.push_back(options.flags & kModelHasLevels ? random.uniform() * 0.8f : 0.0f);
        for (uint32_t j = 0; j < 3 * K; ++j)
            anchors.offset.push_back(random.normal());
        for (uint32_t j = 0; j < F; ++j)
            anchors.feature.push_back(random.normal());
        for (int c = 0; c < 6; ++c)
            anchors.scale.push_back(options.log_scale + 0.7f * random.normal());
    }
    return anchors;
}

void makeCompact(SyntheticAnchors& anchors, const SyntheticOptions& options)
{
    const auto round = [](std::vector<float>& values, size_t each, int bits) {
        for (size_t first = 0; first < values.size(); first += each) {
            const std::span<float> of_anchor(values.data() + first, each);
            float largest = 0;
            for (const float v : of_anchor)
                largest = std::max(largest, std::fabs(v));
            const float step = powerOfTwo(compactExponent(largest, bits));
            for (float& v : of_anchor)
                v = std::round(v / step) * step;
        }
    };
    round(anchors.feature, options.feat_dim, kCompactFeatureBits);
    round(anchors.offset, size_t(3) * options.n_offsets, kCompactOffsetBits);
}

std::vector<Mlp> randomMlps(const SyntheticOptions& options)
{
    Random random(options.seed + 1000);
    const uint32_t F = options.feat_dim, K = options.n_offsets;
    std::vector<Mlp> mlps;
    const auto add = [&](MlpKind kind, Activation activation, uint32_t inputs, uint32_t out, float gain) {
        Mlp mlp;
        mlp.kind = kind;
        mlp.activation = activation;
        mlp.inputs = inputs;
        const uint32_t in = (inputs & kMlpTakesFeature ? F : 0) + 3 + (inputs & kMlpTakesDistance ? 1 : 0) +
                            (inputs & kMlpTakesLevel ? 1 : 0) +
                            (inputs & kMlpTakesAppearance ? options.appearance_dim : 0);
        const uint32_t widths[3] = {in, F, out};
        for (int l = 0; l < 2; ++l) {
            mlp.layers[l].in = widths[l];
            mlp.layers[l].out = widths[l + 1];
            const float spread = (l == 0 ? 1.0f : gain) / std::sqrt(float(widths[l]));
            for (uint32_t i = 0; i < widths[l] * widths[l + 1]; ++i)
                mlp.layers[l].weight.push_back(spread * random.normal());
            for (uint32_t i = 0; i < widths[l + 1]; ++i)
                mlp.layers[l].bias.push_back(0.3f * random.normal());
        }
        mlps.push_back(std::move(mlp));
    };
    const uint32_t inputs = kMlpTakesFeature | options.inputs;
    add(MlpKind::Opacity, Activation::Tanh, inputs, K, 1.5f);
    add(MlpKind::Covariance, Activation::None, inputs, 7 * K, 1.5f);
    add(MlpKind::Color, Activation::Sigmoid, inputs, 3 * K, 2.0f);
    if (options.flags & kModelFeatureBank)
        add(MlpKind::FeatureBank, Activation::Softmax,
            (options.flags & kModelBankDistance ? kMlpTakesDistance : 0u) |
                (options.flags & kModelBankLevel ? kMlpTakesLevel : 0u),
            3, 2.0f);
    return mlps;
}

ModelParams syntheticParams(const SyntheticOptions& options)
{
    ModelParams params{};
    params.family = uint32_t(options.levels > 1 ? ModelFamily::OctreeGs : ModelFamily::ScaffoldGs);
    params.flags = options.flags;
    params.feat_dim = options.feat_dim;
    params.n_offsets = options.n_offsets;
    params.appearance_dim = options.appearance_dim;
    params.appearance_rows = options.appearance_rows;
    params.level_rule = uint32_t(options.level_rule);
    params.fork = 2;
    params.level_clamp = int32_t(options.levels) - 1;
    params.standard_dist = 4 * options.extent;
    params.voxel_size = 0.125f;
    params.grid_origin = options.encoding == PositionEncoding::Grid ? -1.37f : 0.0f;
    params.position_encoding = uint32_t(options.encoding);
    params.raster_rules = uint32_t(options.raster_rules);
    params.constant_rotation[0] = 1;
    params.near_z = options.raster_rules == RasterRules::Gsplat ? 0.01f : 0.2f;
    params.lod_scale = 1;
    return params;
}

SyntheticModel::SyntheticModel(const SyntheticOptions& options)
    : SyntheticModel(
          syntheticParams(options), randomAnchors(options), randomMlps(options),
          [&options] {
              Random random(options.seed + 2000);
              std::vector<float> rows(size_t(options.appearance_dim) * options.appearance_rows);
              for (float& value : rows)
                  value = random.normal();
              return rows;
          }(),
          options.cell_log2)
{
}

EyeParams lookAt(const float* position, const float* target, float fov_y, uint32_t width, uint32_t height)
{
    double axes[3][3] = {}; // right, down, forward in world
    double length = 0;
    for (int c = 0; c < 3; ++c) {
        axes[2][c] = double(target[c]) - position[c];
        length += axes[2][c] * axes[2][c];
    }
    for (double& v : axes[2])
        v /= std::sqrt(length);
    const double down[3] = {0, 1, 0};
    const auto cross = [](const double* a, const double* b, double* out) {
        for (int c = 0; c < 3; ++c)
            out[c] = a[(c + 1) % 3] * b[(c + 2) % 3] - a[(c + 2) % 3] * b[(c + 1) % 3];
    };
    cross(down, axes[2], axes[0]);
    length = 0;
    for (const double v : axes[0])
        length += v * v;
    for (double& v : axes[0])
        v /= std::sqrt(length);
    cross(axes[2], axes[0], axes[1]);

    EyeParams eye{};
    eye.width = width;
    eye.height = height;
    eye.tan_fov_y = std::tan(fov_y / 2);
    eye.tan_fov_x = eye.tan_fov_y * float(width) / float(height);
    eye.focal_x = float(width) / (2 * eye.tan_fov_x);
    eye.focal_y = float(height) / (2 * eye.tan_fov_y);
    for (int r = 0; r < 3; ++r) {
        double t = 0;
        for (int c = 0; c < 3; ++c) {
            eye.world_to_view[4 * r + c] = float(axes[r][c]);
            t -= axes[r][c] * position[c];
        }
        eye.world_to_view[4 * r + 3] = float(t);
        eye.center[r] = position[r];
    }
    for (int c = 0; c < 4; ++c) {
        eye.full_projection[c] = eye.world_to_view[c] / eye.tan_fov_x;
        eye.full_projection[4 + c] = eye.world_to_view[4 + c] / eye.tan_fov_y;
        eye.full_projection[8 + c] = eye.full_projection[12 + c] = eye.world_to_view[8 + c];
    }
    return eye;
}

RasterConstants rulesOf(RasterRules rules)
{
    ModelParams params{};
    params.raster_rules = uint32_t(rules);
    params.near_z = rules == RasterRules::Gsplat ? 0.01f : 0.2f;
    return rasterConstants(params, 0);
}

EyeParams eyeAt(float x, float z, uint32_t width, uint32_t height)
{
    const float position[3] = {x, 0.3f, z}, target[3] = {0.1f, -0.2f, 0.3f};
    return lookAt(position, target, 1.1f, width, height);
}

EyeParams eyeAhead(float x, float z, uint32_t width, uint32_t height)
{
    const float position[3] = {x, 0.3f, z}, target[3] = {x, 0.25f, z + 1};
    return lookAt(position, target, 1.1f, width, height);
}

EyeParams offCentre(EyeParams eye, float tan_mid_x, float tan_mid_y)
{
    eye.tan_mid_x = tan_mid_x;
    eye.tan_mid_y = tan_mid_y;
    for (int c = 0; c < 4; ++c) {
        eye.full_projection[c] = (eye.world_to_view[c] - tan_mid_x * eye.world_to_view[8 + c]) / eye.tan_fov_x;
        eye.full_projection[4 + c] = (eye.world_to_view[4 + c] - tan_mid_y * eye.world_to_view[8 + c]) / eye.tan_fov_y;
    }
    return eye;
}

EyeParams randomEye(Random& random, float reach)
{
    float position[3], target[3];
    for (int c = 0; c < 3; ++c) {
        position[c] = random.uniform(-reach, reach);
        target[c] = random.uniform(-2, 2);
    }
    const uint32_t width = 20 + uint32_t(random.uniform() * 300), height = 20 + uint32_t(random.uniform() * 300);
    return lookAt(position, target, random.uniform(0.15f, 2.2f), width, height);
}

EyeParams64 widen(const EyeParams& eye)
{
    EyeParams64 wide{};
    std::copy(std::begin(eye.world_to_view), std::end(eye.world_to_view), wide.world_to_view);
    std::copy(std::begin(eye.full_projection), std::end(eye.full_projection), wide.full_projection);
    std::copy(std::begin(eye.center), std::end(eye.center), wide.center);
    wide.tan_fov_x = eye.tan_fov_x;
    wide.tan_fov_y = eye.tan_fov_y;
    wide.tan_mid_x = eye.tan_mid_x;
    wide.tan_mid_y = eye.tan_mid_y;
    wide.focal_x = eye.focal_x;
    wide.focal_y = eye.focal_y;
    wide.width = eye.width;
    wide.height = eye.height;
    return wide;
}

} // namespace gsc::test
