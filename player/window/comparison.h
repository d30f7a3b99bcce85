// SPDX-License-Identifier: Apache-2.0
// Compares a picture with the exact one of the same pose.
#pragma once

#include "runtime/image/image_io.h"

#include <cstddef>
#include <future>
#include <optional>
#include <span>
#include <vector>

namespace gsc {

enum class CompareMode { Off, Split, Difference };

// Picture of `height` rows of `width` x 4 bytes, rounded as writeImage() does; alpha is 255.
struct Picture8 {
    uint32_t width = 0, height = 0;
    std::vector<std::byte> pixels;
};

struct ComparedNumbers {
    double psnr = 0;            // PSNR over all eyes in dB, +inf if the pictures are equal
    double worst_255 = 0;       // largest difference of a colour channel, in 1/255
    std::optional<double> flip; // FLIP error, mean over pixels and eyes; none while it is being computed
};

class Comparison {
public:
    // Takes one image for each eye, all of equal size. A thread of its own computes FLIP.
    Comparison(std::vector<Image> pictures, std::vector<Image> exact);

    // Makes the picture to show for an eye. Split: the picture left of `share` of the width, the exact one right of
    // it, with a white line between. Difference: the absolute difference times kGain.
    [[nodiscard]] Picture8 show(uint32_t eye, CompareMode mode, double share) const;
    [[nodiscard]] uint32_t eyes() const { return uint32_t(m_exact.size()); }
    [[nodiscard]] ComparedNumbers numbers();
    [[nodiscard]] bool complete();

    static constexpr float kGain = 10;

private:
    std::vector<Image> m_pictures, m_exact;
    ComparedNumbers m_numbers;
    std::future<double> m_flip; // computes FLIP; declared last, because its thread reads the images above
};

// Converts a picture of floats to bytes (red, green, blue, 255).
Picture8 quantise(const Image& image);

} // namespace gsc
