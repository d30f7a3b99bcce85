// SPDX-License-Identifier: Apache-2.0
#include "runtime/metrics/convolve.h"

#include <algorithm>
#include <cstddef>

namespace gsc {

namespace {

// Copies one row with a border of the kernel's radius on both sides, so that the inner loop needs no test.
void padRow(std::span<const float> row, size_t radius, Border border, std::vector<float>& padded)
{
    const size_t width = row.size();
    padded.resize(width + 2 * radius);
    std::copy(row.begin(), row.end(), padded.begin() + ptrdiff_t(radius));
    const bool zero = border == Border::Zero;
    std::fill_n(padded.begin(), radius, zero ? 0.0f : row[0]);
    std::fill_n(padded.begin() + ptrdiff_t(radius + width), radius, zero ? 0.0f : row[width - 1]);
}

} // namespace

void filterPlane(std::span<const float> plane, uint32_t width, uint32_t height, std::span<const double> horizontal,
                 std::span<const double> vertical, Border border, std::vector<float>& out)
{
    out.resize(plane.size());
    std::vector<float> rows(plane.size()), padded;
    std::vector<double> sum(width);
    for (uint32_t y = 0; y < height; ++y) {
        padRow(plane.subspan(size_t(y) * width, width), horizontal.size() / 2, border, padded);
        std::fill(sum.begin(), sum.end(), 0.0);
        for (size_t k = 0; k < horizontal.size(); ++k)
            for (size_t x = 0; x < width; ++x)
                sum[x] += horizontal[k] * double(padded[x + k]);
        for (size_t x = 0; x < width; ++x)
            rows[size_t(y) * width + x] = float(sum[x]);
    }
    const int64_t radius = int64_t(vertical.size() / 2);
    for (int64_t y = 0; y < int64_t(height); ++y) {
        std::fill(sum.begin(), sum.end(), 0.0);
        for (int64_t k = -radius; k <= radius; ++k) {
            const int64_t source = std::clamp<int64_t>(y + k, 0, int64_t(height) - 1);
            if (border == Border::Zero && source != y + k)
                continue;
            const double weight = vertical[size_t(k + radius)];
            const float* row = rows.data() + source * int64_t(width);
            for (size_t x = 0; x < width; ++x)
                sum[x] += weight * double(row[x]);
        }
        for (size_t x = 0; x < width; ++x)
            out[size_t(y) * width + x] = float(sum[x]);
    }
}

} // namespace gsc
