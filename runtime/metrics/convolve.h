// SPDX-License-Identifier: Apache-2.0
// Separable convolution of one plane, shared by SSIM and FLIP.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace gsc {

enum class Border { Zero, Replicate };

// `out` = `plane` (width x height, row-major) convolved with horizontal[x] * vertical[y], both of odd length and
// centred. `out` is resized and may not be `plane`.
// note: a true convolution flips the kernel; this one does not (correlation), which only turns signs of odd kernels
void filterPlane(std::span<const float> plane, uint32_t width, uint32_t height, std::span<const double> horizontal,
                 std::span<const double> vertical, Border border, std::vector<float>& out);

} // namespace gsc
