// SPDX-License-Identifier: Apache-2.0
// Separable convolution of one plane, for SSIM and FLIP.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace gsc {

enum class Border { Zero, Replicate };

// Computes `out`: `plane` (width x height, row-major) filtered with horizontal[x] * vertical[y]. Both kernels have odd
// lengths and are centred. `out` is resized, and must not be `plane`. note: a true convolution flips the kernel; this
// one does not (it is a correlation), which only changes the sign for odd kernels
void filterPlane(std::span<const float> plane, uint32_t width, uint32_t height, std::span<const double> horizontal,
                 std::span<const double> vertical, Border border, std::vector<float>& out);

} // namespace gsc
