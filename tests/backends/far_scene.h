// SPDX-License-Identifier: Apache-2.0
// Scenes of the tests of FrameOptions::detail on a GPU, and pictures to compare with.
#pragma once

#include "tests/backends/reuse_scene.h"

#include <cmath>
#include <cstdlib>
#include <sstream>

namespace gsc::test {

constexpr float kFarAway = 30; // world units from the eye to the middle of a far scene
constexpr uint32_t kFarWidth = 96, kFarHeight = 72;

// Far and dense: pixels of farEye() span some 0.17 units, most Gaussians a quarter of that. A plate that faces the eye.
inline SyntheticOptions farOptions(uint32_t anchors = 4096)
{
    SyntheticOptions options{.anchors = anchors, .seed = 11};
    return options;
}

// Features change slowly from place to place, as those of a trained model do.
inline SyntheticAnchors farAnchors(const SyntheticOptions& options)
{
    SyntheticAnchors anchors = randomAnchors(options);
    Random random(options.seed + 3000);
    std::vector<float> waves(3 * size_t(options.feat_dim));
    for (float& wave : waves)
        wave = random.normal();
    for (size_t i = 0; i < anchors.count(); ++i) {
        float* const position = anchors.position.data() + 3 * i;
        position[2] *= 0.125f;
        for (uint32_t f = 0; f < options.feat_dim; ++f) {
            const float* const wave = waves.data() + 3 * size_t(f);
            float& feature = anchors.feature[i * options.feat_dim + f];
            feature =
                1.4f * std::sin(0.5f * (wave[0] * position[0] + wave[1] * position[1]) + 3 * wave[2]) + 0.1f * feature;
        }
    }
    return anchors;
}

// Gaussians of an anchor are of much the same colour.
inline std::vector<Mlp> farMlps(const SyntheticOptions& options)
{
    std::vector<Mlp> mlps = randomMlps(options);
    for (Mlp& mlp : mlps)
        if (mlp.kind == MlpKind::Color) {
            LinearLayer& out = mlp.layers[1];
            for (uint32_t o = 3; o < out.out; ++o) {
                for (uint32_t i = 0; i < out.in; ++i)
                    out.weight[size_t(o) * out.in + i] =
                        out.weight[size_t(o % 3) * out.in + i] + 0.2f * out.weight[size_t(o) * out.in + i];
                out.bias[o] = out.bias[o % 3];
            }
        }
    return mlps;
}

inline std::vector<float> embeddingOf(const SyntheticOptions& options)
{
    Random random(options.seed + 2000);
    std::vector<float> rows(size_t(options.appearance_dim) * options.appearance_rows);
    for (float& value : rows)
        value = random.normal();
    return rows;
}

class FarModel : public SyntheticModel {
public:
    explicit FarModel(const SyntheticOptions& options = farOptions()) : FarModel(options, farAnchors(options)) {}
    FarModel(const SyntheticOptions& options, const SyntheticAnchors& anchors)
        : SyntheticModel(syntheticParams(options), anchors, farMlps(options), embeddingOf(options), options.cell_log2)
    {
    }
};

// An eye at x, as far away as that, which looks at a place of the plate.
inline EyeParams farEye(float x = 0, float at = 0, uint32_t width = kFarWidth, uint32_t height = kFarHeight)
{
    const float position[3] = {x, 0.3f, -kFarAway}, target[3] = {at, 0, 0};
    return lookAt(position, target, 0.4f, width, height);
}

// Two that look the same way, and so share their bins.
inline std::vector<EyeParams> farPair(float x = 0, float apart = 0.2f)
{
    return {farEye(x, x), farEye(x + apart, x + apart)};
}

inline FrameOptions detailed(float detail)
{
    FrameOptions options = onGrey(Tier::Fast);
    options.detail = detail;
    return options;
}

inline uint64_t groupsOf(const CoarseCounts& counts)
{
    return counts.near + counts.kept + counts.stale + counts.made;
}

// Draws until nothing is made any more.
inline std::vector<Image<float>> settled(Renderer& renderer, const std::vector<EyeParams>& eyes,
                                         const FrameOptions& options)
{
    std::vector<Image<float>> images;
    for (int i = 0; i < 12; ++i) {
        images = render(renderer, eyes, options);
        if (i > 0 && images[0].result.coarse.made == 0)
            return images;
    }
    FAIL("copies are made for ever");
    return images;
}

inline double psnr(const Image<float>& a, const Image<float>& b)
{
    return compare(a.pixels, b.pixels).psnr;
}

// Prints the values as a message, if GSC_TEST_VERBOSE is set.
template <typename... Values>
void tell(const Values&... values)
{
    if (std::getenv("GSC_TEST_VERBOSE") == nullptr)
        return;
    std::ostringstream text;
    (text << ... << values);
    MESSAGE(text.str());
}

} // namespace gsc::test
