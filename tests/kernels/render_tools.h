// SPDX-License-Identifier: Apache-2.0
// Whole images for the stage and frame tests.
#pragma once

#include "runtime/renderer.h"
#include "runtime/cpu/renderer_cpu.h"

#include <algorithm>
#include <cmath>
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
