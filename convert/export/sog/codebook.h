// SPDX-License-Identifier: Apache-2.0
// Finds few numbers that stand for many, or few vectors that stand for many.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace gsc {

// 256 numbers in ascending order.
struct Codebook {
    std::array<float, 256> values{};

    [[nodiscard]] uint8_t nearest(float value) const;
};

// Makes the codebook with the least squared error. It starts from ranges of equal error, whose width falls with the
// cube root of the density (Panter and Dite 1951), and improves them by Lloyd's rule. Precondition: `numbers` is not
// empty, and all are finite.
Codebook makeCodebook(std::vector<float> numbers);

// Vectors of `size` floats each, one after the other.
struct Palette {
    size_t size = 0;
    std::vector<float> centers;   // means of the vectors that they stand for
    std::vector<uint32_t> labels; // for each vector, the number of the centre that stands for it
};

// Makes at most `most` centres. The group of vectors with the largest squared error is cut in two at its mean, across
// its longest axis, until there are so many groups or no error is left. Precondition: `vectors` is not empty, and all
// are finite.
Palette makePalette(std::span<const float> vectors, size_t size, size_t most);

} // namespace gsc
