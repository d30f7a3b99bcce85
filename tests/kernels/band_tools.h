// SPDX-License-Identifier: Apache-2.0
// An image drawn in bands of columns, held against the same drawn as a whole.
#pragma once

#include "tests/kernels/render_tools.h"
#include "tests/kernels/synthetic_model.h"

#include <doctest/doctest.h>

#include <cstring>
#include <vector>

namespace gsc::test {

inline SyntheticOptions bandScene(RasterRules rules, float log_scale = -3, uint32_t anchors = 1500)
{
    SyntheticOptions options{.anchors = anchors, .raster_rules = rules, .log_scale = log_scale};
    return options;
}

inline std::vector<EyeParams> eyesApart(uint32_t width, uint32_t height)
{
    return {eyeAt(0.4f, -5, width, height), eyeAt(0.7f, -5, width, height)};
}

// Bytes of the targets of a frame, 0x5a where nothing was written.
struct BandPicture {
    std::vector<std::vector<unsigned char>> pixels, depths; // per eye, with gaps behind the rows
    FrameResult result;
};

constexpr size_t kBandGap = 24; // bytes behind a row

inline BandPicture drawBand(Renderer& renderer, const std::vector<EyeParams>& eyes, const FrameOptions& options,
                            PixelFormat format, bool depths)
{
    BandPicture picture;
    std::vector<FrameTarget> targets;
    for (const EyeParams& eye : eyes) {
        const size_t pitch = eye.width * pixelBytes(format) + kBandGap, depth_pitch = 4 * size_t(eye.width) + kBandGap;
        picture.pixels.emplace_back(pitch * eye.height, 0x5a);
        picture.depths.emplace_back(depths ? depth_pitch * eye.height : 0, 0x5a);
        FrameTarget& target =
            targets.emplace_back(FrameTarget{FrameTarget::Kind::Host, format, picture.pixels.back().data(), pitch, 0});
        if (depths) {
            target.depth = reinterpret_cast<float*>(picture.depths.back().data());
            target.depth_pitch = depth_pitch;
        }
    }
    picture.result = gsc::render(renderer, {eyes, targets, options});
    return picture;
}

// Is `band` the columns of `whole`, of `pixel` bytes a pixel, and untouched elsewhere?
inline bool isBandOf(const std::vector<unsigned char>& band, const std::vector<unsigned char>& whole, uint32_t height,
                     size_t pixel, const ColumnRange& columns)
{
    const size_t pitch = whole.size() / height, first = columns.first * pixel, end = columns.end * pixel;
    size_t wrong = 0;
    for (size_t i = 0; i < band.size(); ++i)
        wrong += band[i] != (i % pitch < first || i % pitch >= end ? 0x5a : whole[i]);
    return wrong == 0;
}

// Cuts the columns out of a picture of three floats a pixel.
inline std::vector<float> columnsOf(const std::vector<float>& pixels, uint32_t width, const ColumnRange& columns)
{
    std::vector<float> cut;
    for (size_t i = 0; i < pixels.size(); ++i)
        if (const size_t x = i / 3 % width; x >= columns.first && x < columns.end)
            cut.push_back(pixels[i]);
    return cut;
}

// Draws the image as a whole and in bands that begin at `cuts` besides 0, and checks every column. Returns what of the
// anchors' decodes each band took, the whole being 1.
inline std::vector<double> checkBands(Renderer& renderer, const std::vector<EyeParams>& eyes, FrameOptions options,
                                      const std::vector<uint32_t>& cuts, PixelFormat format = PixelFormat::Rgb32f,
                                      bool depths = false)
{
    const auto decoded = [](const FrameResult& result) {
        return double(result.eyes[0].anchors_decoded + result.eyes[1].anchors_decoded);
    };
    options.columns = {};
    const BandPicture whole = drawBand(renderer, eyes, options, format, depths);
    std::vector<double> shares;
    for (size_t b = 0; b <= cuts.size(); ++b) {
        options.columns = {b == 0 ? 0 : cuts[b - 1], b < cuts.size() ? cuts[b] : 65536};
        CAPTURE(options.columns.first);
        const BandPicture band = drawBand(renderer, eyes, options, format, depths);
        for (size_t e = 0; e < eyes.size(); ++e) {
            CAPTURE(e);
            const ColumnRange columns = options.columns.within(eyes[e].width);
            CHECK(isBandOf(band.pixels[e], whole.pixels[e], eyes[e].height, pixelBytes(format), columns));
            if (depths)
                CHECK(isBandOf(band.depths[e], whole.depths[e], eyes[e].height, 4, columns));
            CHECK(band.result.eyes[e].gaussians_visible <= whole.result.eyes[e].gaussians_visible);
        }
        shares.push_back(decoded(band.result) / decoded(whole.result));
    }
    return shares;
}

} // namespace gsc::test
