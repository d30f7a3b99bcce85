// SPDX-License-Identifier: Apache-2.0
// A picture beside the exact one of the same pose, and how far they are apart.
#pragma once

#include "runtime/image/image_io.h"

#include <cstddef>
#include <future>
#include <optional>
#include <span>
#include <vector>

namespace gsc {

enum class CompareMode { Off, Split, Difference };

// Height rows of width x 4 bytes, as writeImage() rounds; alpha is 255.
struct Picture8 {
    uint32_t width = 0, height = 0;
    std::vector<std::byte> pixels;
};

struct ComparedNumbers {
    double psnr = 0;            // PSNR of all eyes together, dB, +inf if equal
    double worst_255 = 0;       // largest difference of a channel, 1/255
    std::optional<double> flip; // mean over pixels and eyes; none while it is worked out
};

class Comparison {
public:
    // One image per eye, of equal sizes. FLIP is worked out by a thread of its own.
    Comparison(std::vector<Image> pictures, std::vector<Image> exact);

    // Split: the picture left of `share` of the width, the exact one right of it, a white line between. Difference: their
    // distance times kGain.
    [[nodiscard]] Picture8 show(uint32_t eye, CompareMode mode, double share) const;
    [[nodiscard]] uint32_t eyes() const { return uint32_t(m_exact.size()); }
    [[nodiscard]] ComparedNumbers numbers();
    [[nodiscard]] bool complete();

    static constexpr float kGain = 10;

private:
    std::vector<Image> m_pictures, m_exact;
    ComparedNumbers m_numbers;
    std::future<double> m_flip; // declared last: its thread reads the images
};

// Picture of bytes (red, green, blue, 255) from one of floats.
Picture8 quantise(const Image& image);

} // namespace gsc
