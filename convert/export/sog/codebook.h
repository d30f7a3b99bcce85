// SPDX-License-Identifier: Apache-2.0
// Few values that stand for many: of numbers, and of vectors.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace gsc {

// 256 numbers, ascending.
struct Codebook {
    std::array<float, 256> values{};

    [[nodiscard]] uint8_t nearest(float value) const;
};

// Makes the codebook of least squared error, by Lloyd's rule from cells of equal error (their width falls with the cube
// root of the density: Panter and Dite 1951). Precondition: finite, not empty.
Codebook makeCodebook(std::vector<float> numbers);

// Vectors of `size` floats one after the other.
struct Palette {
    size_t size = 0;
    std::vector<float> centers;   // their means
    std::vector<uint32_t> labels; // for each vector, the centre that stands for it
};

// At most `most` centres: the set with the largest squared error is cut in two across its longest axis, at its mean, until
// there are so many or no error is left. Precondition: finite, not empty.
Palette makePalette(std::span<const float> vectors, size_t size, size_t most);

} // namespace gsc
