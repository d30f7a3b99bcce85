// SPDX-License-Identifier: Apache-2.0
#include "player/window/comparison.h"

#include "runtime/metrics/metrics.h"

#include <algorithm>
#include <chrono>
#include <cmath>

namespace gsc {

namespace {

ImageView viewOf(const Image& image)
{
    return {image.pixels.data(), image.width, image.height};
}

} // namespace

Picture8 quantise(const Image& image)
{
    Picture8 out{image.width, image.height, std::vector<std::byte>(size_t(image.width) * image.height * 4)};
    for (size_t i = 0; i < out.pixels.size() / 4; ++i) {
        for (size_t c = 0; c < 3; ++c)
            out.pixels[4 * i + c] = std::byte(wholeValue<uint8_t>(image.pixels[3 * i + c]));
        out.pixels[4 * i + 3] = std::byte(255);
    }
    return out;
}

Comparison::Comparison(std::vector<Image> pictures, std::vector<Image> exact)
    : m_pictures(std::move(pictures)), m_exact(std::move(exact))
{
    PooledDifference eyes;
    for (size_t eye = 0; eye < m_exact.size(); ++eye)
        eyes.add(compareImages(viewOf(m_exact[eye]), viewOf(m_pictures[eye])));
    m_numbers.psnr = eyes.psnr();
    m_numbers.worst_255 = 255 * eyes.max_error;
    m_flip = std::async(std::launch::async, [this] {
        double sum = 0;
        for (size_t eye = 0; eye < m_exact.size(); ++eye)
            sum += flip(viewOf(m_exact[eye]), viewOf(m_pictures[eye]));
        return sum / double(m_exact.size());
    });
}

Picture8 Comparison::show(uint32_t eye, CompareMode mode, double share) const
{
    const Image &picture = m_pictures[eye], &exact = m_exact[eye];
    if (mode == CompareMode::Difference) {
        Image difference = picture;
        for (size_t i = 0; i < difference.pixels.size(); ++i)
            difference.pixels[i] = kGain * std::abs(picture.pixels[i] - exact.pixels[i]);
        return quantise(difference);
    }
    Picture8 left = quantise(picture);
    const Picture8 right = quantise(exact);
    const auto cut = uint32_t(std::clamp(share, 0.0, 1.0) * left.width);
    for (uint32_t y = 0; y < left.height; ++y) {
        const size_t row = size_t(y) * left.width;
        std::copy(right.pixels.begin() + ptrdiff_t(4 * (row + cut)),
                  right.pixels.begin() + ptrdiff_t(4 * (row + left.width)),
                  left.pixels.begin() + ptrdiff_t(4 * (row + cut)));
        if (cut < left.width)
            std::fill_n(left.pixels.begin() + ptrdiff_t(4 * (row + cut)), 4, std::byte(255));
    }
    return left;
}

bool Comparison::complete()
{
    return numbers().flip.has_value();
}

ComparedNumbers Comparison::numbers()
{
    if (m_flip.valid() && m_flip.wait_for(std::chrono::seconds(0)) == std::future_status::ready)
        m_numbers.flip = m_flip.get();
    return m_numbers;
}

} // namespace gsc
