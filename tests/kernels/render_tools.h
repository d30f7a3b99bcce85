// SPDX-License-Identifier: Apache-2.0
// Whole images for the stage and frame tests.
#pragma once

#include <gsc/renderer.h>
#include "kernels/present/pixel.h"
#include "runtime/cpu/renderer_cpu.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <vector>

namespace gsc::test {

template <typename Real>
struct Image {
    std::vector<Real> pixels;
    FrameResult result;
};

inline std::vector<Image<float>> render(Renderer& backend, const std::vector<EyeParams>& eyes,
                                        const FrameOptions& options)
{
    std::vector<Image<float>> images(eyes.size());
    std::vector<float*> pointers;
    for (size_t e = 0; e < eyes.size(); ++e) {
        images[e].pixels.assign(size_t(3) * eyes[e].width * eyes[e].height, -7.0f); // a pixel left out shows
        pointers.push_back(images[e].pixels.data());
    }
    const FrameResult result = gsc::render(backend, eyes, options, pointers.data());
    for (Image<float>& image : images)
        image.result = result;
    return images;
}

inline bool sameBytes(const std::vector<float>& a, const std::vector<float>& b)
{
    return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(float)) == 0;
}

inline bool sameBytes(const std::vector<Image<float>>& a, const std::vector<Image<float>>& b)
{
    return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                      [](const auto& one, const auto& other) { return sameBytes(one.pixels, other.pixels); });
}

inline FrameOptions over(float grey, FrameOptions options = {})
{
    std::fill_n(options.background, 3, grey);
    return options;
}

inline FrameOptions onGrey(Tier tier = Tier::Fast)
{
    FrameOptions options = over(0.5f);
    options.tier = tier;
    return options;
}

inline FrameOptions mergedEyes(FrameOptions options)
{
    options.stereo = StereoMode::Merged;
    return options;
}

// Depths of the eyes' pixels; -7 where none was written. `pictures` takes what is drawn beside them.
inline std::vector<std::vector<float>> renderDepths(Renderer& renderer, const std::vector<EyeParams>& eyes,
                                                    const FrameOptions& options,
                                                    std::vector<std::vector<float>>& pictures)
{
    std::vector<std::vector<float>> depths(eyes.size());
    std::vector<FrameTarget> targets(eyes.size());
    pictures.resize(eyes.size());
    for (size_t e = 0; e < eyes.size(); ++e) {
        depths[e].assign(size_t(eyes[e].width) * eyes[e].height, -7.0f);
        pictures[e].assign(3 * depths[e].size(), -7.0f);
        targets[e] = hostTarget(pictures[e].data());
        targets[e].depth = depths[e].data();
    }
    gsc::render(renderer, {eyes, targets, options});
    return depths;
}

// Share of pixels that have another depth; `rounding`: the part of a depth by which the same may differ.
inline double otherDepths(const std::vector<float>& a, const std::vector<float>& b, double rounding)
{
    size_t others = a.size() == b.size() ? 0 : a.size();
    for (size_t i = 0; i < std::min(a.size(), b.size()); ++i)
        others += !(a[i] == b[i] || std::abs(double(a[i]) - double(b[i])) <= rounding * double(a[i]));
    return double(others) / double(a.size());
}

inline Image<float> renderWith(CpuPath path, int threads, const ModelView& model, const EyeParams& eye,
                               const FrameOptions& options)
{
    const std::unique_ptr<Renderer> backend = makeCpuRenderer(path, threads);
    backend->load(model);
    return render(*backend, {eye}, options)[0];
}

inline Image<double> render64(const ModelView& model, const EyeParams64& eye, const FrameOptions& options)
{
    Image<double> image;
    image.pixels.assign(size_t(3) * eye.width * eye.height, -7.0);
    double* pointer = image.pixels.data();
    renderReference64(model, &eye, 1, options, &pointer, image.result);
    return image;
}

// Bytes of a target that holds the picture, with `fill` behind the pixels of each row.
inline std::vector<unsigned char> inTarget(const std::vector<float>& picture, uint32_t width, PixelFormat format,
                                           size_t pitch, unsigned char fill)
{
    const size_t height = picture.size() / 3 / width, pixel = pixelBytes(format);
    std::vector<unsigned char> rows(pitch * height, fill);
    for (size_t i = 0; i < height * width; ++i) {
        const float* const rgb = picture.data() + 3 * i;
        const PixelBytes bytes = pixelBytesOf(rgb);
        const PixelBytes turned{bytes.b, bytes.g, bytes.r, bytes.a};
        const PixelHalves halves = pixelHalvesOf(rgb);
        const void* const from = format == PixelFormat::Rgb32f    ? static_cast<const void*>(rgb)
                                 : format == PixelFormat::Bgra8   ? static_cast<const void*>(&turned)
                                 : format == PixelFormat::Rgba16f ? static_cast<const void*>(&halves)
                                                                  : static_cast<const void*>(&bytes);
        std::memcpy(rows.data() + i / width * pitch + i % width * pixel, from, pixel);
    }
    return rows;
}

struct Difference {
    double psnr, worst;
    size_t above; // values that differ by more than 1/255
};

template <typename A, typename B>
Difference compare(const std::vector<A>& a, const std::vector<B>& b)
{
    Difference difference{0, 0, 0};
    double sum = 0;
    for (size_t i = 0; i < a.size(); ++i) {
        const double d = std::abs(double(a[i]) - double(b[i]));
        sum += d * d;
        difference.worst = std::max(difference.worst, d);
        difference.above += d > 1.0 / 255;
    }
    difference.psnr = sum > 0 ? -10 * std::log10(sum / double(a.size())) : 200;
    return difference;
}

} // namespace gsc::test
