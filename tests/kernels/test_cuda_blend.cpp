// SPDX-License-Identifier: Apache-2.0
// Sorted splats to pixels on the device, against a loop over every splat of a bin for every pixel.
#include "tests/kernels/gpu_blend.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>

using namespace gsc;
using namespace gsc::test;

namespace {

const std::vector<Size> kSizes = {{1, 1}, {31, 15}, {32, 16}, {33, 17}, {100, 70}};

template <typename Splat>
void checkSizes()
{
    for (const uint32_t bin_height : {16u, 32u})
        for (const RasterRules raster : {RasterRules::DiffGaussian, RasterRules::Gsplat})
            for (const Size& size : kSizes)
                for (const uint32_t count : {1u, 127u, 129u, 600u}) {
                    CAPTURE(bin_height);
                    CAPTURE(uint32_t(raster));
                    CAPTURE(size.width);
                    CAPTURE(count);
                    Shapes shapes;
                    shapes.hollow = std::is_same_v<Splat, ExactSplat>;
                    const auto scene =
                        randomScene<Splat>({size}, bin_height, raster, count, count + size.width, shapes);
                    const Drawn drawn = blendOnDevice(scene);
                    checkPixels(scene, drawn, kUsualBound<Splat>);
                }
}

template <typename Splat>
void checkEmpty()
{
    for (const uint32_t passes : {1u, 2u})
        for (const bool empty_is_black : {true, false})
            for (const uint32_t any_positive : {0u, 1u}) {
                auto scene = emptyScene<Splat>({{33, 17}, {5, 40}}, 16, RasterRules::DiffGaussian);
                scene.splats.emplace_back(); // in no list
                scene.empty_is_black = empty_is_black;
                scene.any_positive = any_positive;
                const Drawn drawn = blendOnDevice(scene, passes, 1);
                const bool black = empty_is_black && any_positive == 0;
                for (uint32_t e = 0; e < 2; ++e)
                    for (size_t i = 0; i < drawn.images[e].size(); ++i)
                        if (drawn.images[e][i] != (black ? 0.0f : scene.background[i % 3])) {
                            CHECK(drawn.images[e][i] == (black ? 0.0f : scene.background[i % 3]));
                            break;
                        }
                CHECK(drawn.counters.evaluations[0] == 0);
            }
}

// Opaque splats over the whole image, then one of another colour that must not show.
template <typename Splat>
void checkSaturation()
{
    for (const RasterRules raster : {RasterRules::DiffGaussian, RasterRules::Gsplat})
        for (const uint32_t passes : {1u, 4u})
            for (const uint32_t longest : {0u, 9u}) {
                auto scene = emptyScene<Splat>({{50, 30}}, 16, raster);
                Ellipse e{25, 15, 1e6f, 0, 1e6f, 1, {1, 0, 0}, {0, 0, 4, 2}};
                for (int i = 0; i < 8; ++i) // the second would leave too little and is not drawn
                    addSplat(scene, 0, e);
                e.color[0] = 0;
                e.color[1] = 1;
                for (int i = 0; i < 3000; ++i)
                    addSplat(scene, 0, e);
                const Drawn drawn = blendOnDevice(scene, passes, longest);
                bool red = true, green = false;
                const std::vector<float>& image = drawn.images[0];
                const float at_least = raster == RasterRules::Gsplat ? 0.9989f : 0.9899f;
                for (size_t i = 0; i < image.size(); i += 3) {
                    red &= image[i] >= at_least && image[i] <= 1;
                    green |= image[i + 1] > 0.02f; // background that the last red splat would have covered
                }
                CHECK(red);
                CHECK_FALSE(green);
                // a list ends with the batch in which the last pixel is finished
                CHECK(drawn.counters.evaluations[0] <= 64u * 32 * 1024);
            }
}

} // namespace

TEST_CASE("blend fast: image sizes around a bin, few splats and many, both rasterisers and bin heights")
{
    checkSizes<PackedSplat>();
}

TEST_CASE("blend exact: image sizes around a bin, few splats and many, both rasterisers and bin heights")
{
    checkSizes<ExactSplat>();
}

TEST_CASE("trap 25: blend of nothing is the background, or black")
{
    checkEmpty<PackedSplat>();
    checkEmpty<ExactSplat>();
}

TEST_CASE("blend: finished pixels take no more, and a finished bin ends its list")
{
    checkSaturation<PackedSplat>();
    checkSaturation<ExactSplat>();
}

TEST_CASE("blend fast: a needle is drawn to its ends, whose radius its inverse no longer tells")
{
    for (const float sigma : {300.0f, 1000.0f, 4000.0f})
        for (const float angle : {0.0f, 0.3f, 0.8f}) {
            CAPTURE(sigma);
            CAPTURE(angle);
            auto scene = emptyScene<PackedSplat>({{200, 90}}, 16, RasterRules::DiffGaussian);
            const float ca = std::cos(angle), sa = std::sin(angle), s1 = sigma * sigma, s2 = 0.4f;
            const Ellipse e{100,
                            45,
                            s1 * ca * ca + s2 * sa * sa,
                            (s1 - s2) * ca * sa,
                            s1 * sa * sa + s2 * ca * ca,
                            0.8f,
                            {1, 0.5f, 0.2f},
                            {0, 0, 13, 6}};
            addSplat(scene, 0, e);
            const Drawn drawn = blendOnDevice(scene);
            checkPixels(scene, drawn, 1.0);
            // where it leaves the image, far within its three sigma
            const auto x = uint32_t(100 + std::min(99.0f, 44 / std::max(std::tan(angle), 1e-3f)));
            const auto y = uint32_t(std::lround(45 + (float(x) - 100) * std::tan(angle)));
            CHECK(drawn.images[0][(size_t(y) * 200 + x) * 3] > 0.2f);
        }
}

TEST_CASE("blend: an image of as many bins as there can be")
{
    for (const Size& size : {Size{3, kMaxBins * 32 - 5}, Size{kMaxBins * kBinWidth - 3, 2}}) {
        const auto scene = randomScene<PackedSplat>({size}, 32, RasterRules::DiffGaussian, 500, 8);
        checkPixels(scene, blendOnDevice(scene), kUsualBound<PackedSplat>);
    }
}
